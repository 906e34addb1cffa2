# Everything a newcomer needs is `make demo` and `make test`; both do all set-up by themselves, once.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
PIP := $(BIN)/python -m pip --disable-pip-version-check
# Wheels only: building a package from source would fetch build tools that no hash covers.
LOCKED := install --quiet --require-hashes --only-binary :all:
EDITABLE := install --quiet --no-deps --no-build-isolation --editable .

# As the command line does: threads of OpenBLAS wait for each other, and our matrices are small.
export OPENBLAS_NUM_THREADS := 1

# Tests start hundreds of processes, and each would compile all modules where the shell forbids to keep them.
test test-slow: export PYTHONDONTWRITEBYTECODE :=

# A worker that has nothing left takes from the others; at first each has a run of neighbours, which share fixtures.
ON_ALL_CORES := --numprocesses auto --dist worksteal

.PHONY: help docs dist demo setup setup-dev test test-slow check prove audit fuzz format bench bench-setup lock clean
.DELETE_ON_ERROR:

help:
	@echo "make demo       identify a virtual wearer, float the arm, write a report"
	@echo "make test       tests, without the slow ones and further seeds (make test-slow: all of them)"
	@echo "make check      style, types, the direction of imports, and the language"
	@echo "make prove      prove the guard's promises on its source (ten minutes at most)"
	@echo "make audit      packages of the lock files (CycloneDX) and known advisories about them, in out/audit"
	@echo "make fuzz       give changed bytes to every reader of foreign bytes, one minute each (SECONDS=600: ten)"
	@echo "make docs       the documentation as a site, in docs/_build/html"
	@echo "make dist       wheel and source archive in dist, checked, installed into an empty environment and started"
	@echo "make format     put the code into the common form"
	@echo "make bench      time our kernels beside every opponent, write benchmarks/README.md (a quarter of an hour)"
	@echo "make bench-setup  install the opponents of make bench"
	@echo "make setup      only the environment of make demo, in $(VENV)"
	@echo "make lock       resolve the dependencies anew"
	@echo "make clean      remove what these commands made"

demo: setup
	$(BIN)/exograv demo

# Checks the shape and type of every argument at every call. It doubles the time, so `make test` does it only where
# CI is set; `make test-slow` always.
SHAPES := --jaxtyping-packages=exograv,peers,beartype.beartype

# Pages and flights want a computer of their own: a person's touches have their times, and a real-time process takes its
# processor from others. `make test-slow`, and a server that others share, run them one by one; else flights are one group.
ALONE := tests/browser tests/live
NOT_ALONE := $(ALONE:%=--ignore=%)

# A server also runs what takes seconds: whole sessions, further seeds of a sweep, all examples of a property.
FAST := $(if $(CI),not slow,not slow and not long)

test: setup-dev
	$(BIN)/python -m pytest -m "$(FAST)" $(NOT_ALONE) $(ON_ALL_CORES) $(if $(CI),$(SHAPES))
	$(BIN)/python -m pytest -m "$(FAST)" $(ALONE) $(if $(CI),$(SHAPES),--numprocesses 2 --dist loadgroup)

test-slow: setup-dev
	$(BIN)/python -m pytest $(NOT_ALONE) $(ON_ALL_CORES) $(SHAPES)
	$(BIN)/python -m pytest $(ALONE) $(SHAPES)

check: setup-dev
	$(BIN)/ruff check
	$(BIN)/ruff format --check
	$(BIN)/pyright
	$(BIN)/lint-imports
	$(BIN)/python benchmarks/language.py --check

format: setup-dev
	$(BIN)/ruff check --fix
	$(BIN)/ruff format

# Opponents that are not installed are reported as missing.
bench: setup
	$(BIN)/python benchmarks/kernels.py --save benchmarks/results.json
	$(BIN)/python benchmarks/publish.py benchmarks/results.json

# The guard's promises, proved on its source; and that wrong guards are refuted.
prove: $(VENV)/installed-prove
	$(BIN)/python benchmarks/proof/prove.py
	$(BIN)/python -m pytest -m "slow or not slow" tests/benchmarks/proof

# It publishes and never fails: an advisory that appears today says nothing about the change under test.
audit: $(VENV)/installed-audit
	$(BIN)/python benchmarks/audit.py

SECONDS ?= 60

fuzz: $(VENV)/installed-fuzz
	$(BIN)/python benchmarks/fuzz/run.py --seconds $(SECONDS)

bench-setup: $(VENV)/installed-bench

# The documentation as a site, in docs/_build/html; every warning is an error.
docs: $(VENV)/installed-docs
	$(BIN)/python docs/generate.py
	$(BIN)/sphinx-build --fail-on-warning --keep-going --quiet -b html docs docs/_build/html
	@echo "The site: docs/_build/html/index.html"

# The files of a release. The wheel is installed into an empty environment, with the core's packages only, and started.
dist: $(VENV)/installed-docs
	rm -rf dist
	$(BIN)/python -m build --no-isolation --outdir dist
	$(BIN)/twine check --strict dist/*
	$(BIN)/python -m venv dist/empty
	dist/empty/bin/python -m pip install --quiet --disable-pip-version-check dist/*.whl
	cd dist && empty/bin/exograv --version && empty/bin/exograv rigs > /dev/null && empty/bin/exograv doctor
	rm -rf dist/empty

setup: $(VENV)/installed

setup-dev: $(VENV)/installed-dev

$(BIN)/python:
	@command -v "$(PYTHON)" > /dev/null || \
	  { echo "There is no '$(PYTHON)' here. Install Python 3.11 or newer, or name one: make PYTHON=python3.12"; exit 1; }
	@"$(PYTHON)" -c 'import sys; sys.exit(sys.version_info < (3, 11))' || \
	  { echo "exograv needs Python 3.11 or newer; '$(PYTHON)' is older. Name another: make PYTHON=python3.12"; exit 1; }
	@"$(PYTHON)" -m venv $(VENV) || { rm -rf $(VENV); \
	  echo "'$(PYTHON)' could not make a virtual environment. On Debian and Ubuntu: apt install python3-venv"; exit 1; }

$(VENV)/installed: requirements.lock pyproject.toml hatch_build.py src/exograv/safety/native/core.c | $(BIN)/python
	@echo "Installing into $(VENV); this takes a minute, once."
	@$(PIP) $(LOCKED) --requirement requirements.lock
	@$(PIP) $(EDITABLE)
	@$(BIN)/python -m compileall -q src/exograv
	@touch $@

$(VENV)/installed-dev: requirements-dev.lock | $(VENV)/installed
	@echo "Installing what tests and checks need; this takes a minute, once."
	@$(PIP) $(LOCKED) --requirement requirements-dev.lock
	@touch $@

$(VENV)/installed-docs: requirements-docs.lock | $(VENV)/installed
	@echo "Installing the generator of the documentation; this takes some seconds, once."
	@$(PIP) $(LOCKED) --requirement requirements-docs.lock
	@touch $@

$(VENV)/installed-bench: requirements-bench.lock | $(VENV)/installed
	@echo "Installing the opponents of make bench (2 GB); this takes some minutes, once."
	@$(PIP) $(LOCKED) --requirement requirements-bench.lock
	@touch $@

$(VENV)/installed-prove: requirements-prove.lock | $(VENV)/installed-dev
	@echo "Installing the solver of make prove; this takes some seconds, once."
	@$(PIP) $(LOCKED) --requirement requirements-prove.lock
	@touch $@

$(VENV)/installed-audit: requirements-audit.lock | $(VENV)/installed
	@echo "Installing the tools of make audit; this takes some seconds, once."
	@$(PIP) $(LOCKED) --requirement requirements-audit.lock
	@touch $@

# The seeds of the console's messages come from its test with real connections, which needs the packages of the tests.
$(VENV)/installed-fuzz: requirements-fuzz.lock | $(VENV)/installed-dev
	@echo "Installing the fuzzer of make fuzz; this takes some seconds, once."
	@$(PIP) $(LOCKED) --requirement requirements-fuzz.lock
	@touch $@

# One resolution for Python 3.11 and newer on every platform; later files keep to the versions of earlier ones.
COMPILE = $(BIN)/uv pip compile --quiet --no-config --universal --python-version 3.11 --generate-hashes \
  --no-annotate --custom-compile-command "make lock" --upgrade --extra all pyproject.toml

lock: setup-dev
	$(COMPILE) --group build --output-file requirements.lock
	$(COMPILE) --group dev --constraints requirements.lock --output-file requirements-dev.lock
	$(COMPILE) --group docs --constraints requirements-dev.lock --output-file requirements-docs.lock
	$(COMPILE) --group bench --constraints requirements-dev.lock --output-file requirements-bench.lock
	$(COMPILE) --group prove --constraints requirements-dev.lock --output-file requirements-prove.lock
	$(COMPILE) --group audit --constraints requirements-dev.lock --output-file requirements-audit.lock
	$(COMPILE) --group fuzz --constraints requirements-dev.lock --output-file requirements-fuzz.lock

clean:
	rm -rf $(VENV) out dist docs/_build docs/reference/generated .pytest_cache .ruff_cache .hypothesis .import_linter_cache
	find src tests -name __pycache__ -type d -prune -exec rm -rf {} +
