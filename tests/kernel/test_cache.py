"""Code is compiled once, and read from disk only if it is complete and no other user could have put it there."""

import os
from pathlib import Path

import casadi as ca
import numpy as np
import pytest

from exograv import kernel
from exograv.errors import KernelError
from exograv.kernel import cache, compilation, native, object_code


@pytest.fixture(autouse=True)
def empty_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    return tmp_path / "exograv" / "kernels"


def cube() -> ca.Function:
    x = ca.SX.sym("x", 2)
    return ca.Function("cube", [x], [x**3 + 0.5], ["x"], ["y"])


def check(compiled: kernel.Kernel) -> None:
    np.testing.assert_array_equal(compiled.of([1.0, 2.0])[0], [1.5, 8.5])


def test_the_second_start_compiles_nothing(monkeypatch: pytest.MonkeyPatch):
    assert not native.compile(cube()).from_cache

    def refuse(_text: str) -> bytes:
        raise AssertionError("compiled again")

    monkeypatch.setattr(native, "object_code", refuse)
    again = native.compile(cube())
    assert again.from_cache
    check(again)


def test_another_processor_gets_its_own_code(monkeypatch: pytest.MonkeyPatch):
    native.compile(cube())
    here = object_code.processor()
    for other in (
        object_code.Processor(here.name + "-next", here.features),
        object_code.Processor(here.name, here.features + ",-fma"),
    ):
        monkeypatch.setattr(native, "processor", lambda other=other: other)
        assert not native.compile(cube()).from_cache


def test_a_changed_compiler_makes_its_own_code(monkeypatch: pytest.MonkeyPatch):
    native.compile(cube())
    monkeypatch.setattr(cache, "_own_source", lambda: "changed")
    assert not native.compile(cube()).from_cache


@pytest.mark.parametrize(
    "damage",
    [lambda code: code[:-1], lambda code: code[:40] + b"?" + code[41:], lambda _: b""],
    ids=["cut off", "one byte", "empty"],
)
def test_damaged_code_is_not_run(damage, empty_cache: Path, caplog: pytest.LogCaptureFixture):
    native.compile(cube())
    (kept,) = empty_cache.iterdir()
    kept.write_bytes(damage(kept.read_bytes()))
    compiled = native.compile(cube())
    assert not compiled.from_cache
    assert "is damaged; the kernel is compiled again" in caplog.text
    check(compiled)


def test_code_under_another_name_is_not_run(empty_cache: Path):
    x = ca.SX.sym("x", 2)
    native.compile(cube())
    (first,) = empty_cache.iterdir()
    native.compile(ca.Function("cube", [x], [x + 0.5], ["x"], ["y"]))
    (second,) = set(empty_cache.iterdir()) - {first}
    first.write_bytes(second.read_bytes())
    check(native.compile(cube()))


@pytest.mark.parametrize("variables", [{}, {"XDG_CACHE_HOME": "relative"}], ids=["no home", "relative"])
def test_a_user_without_a_home_compiles_each_time(variables: dict[str, str], monkeypatch: pytest.MonkeyPatch):
    def homeless() -> Path:
        raise RuntimeError("Could not determine home directory.")

    monkeypatch.delenv("XDG_CACHE_HOME")
    for name, value in variables.items():
        monkeypatch.setenv(name, value)
    monkeypatch.setattr(Path, "home", homeless)
    assert cache.folder() is None
    for _ in range(2):
        compiled = native.compile(cube())
        assert not compiled.from_cache
        check(compiled)


def test_code_from_a_folder_that_others_may_write_is_not_run(empty_cache: Path, caplog: pytest.LogCaptureFixture):
    native.compile(cube())
    empty_cache.chmod(0o777)
    assert not native.compile(cube()).from_cache
    assert "chmod 700" in caplog.text


def test_code_of_another_user_is_not_run(monkeypatch: pytest.MonkeyPatch):
    native.compile(cube())
    someone = os.getuid() + 1
    monkeypatch.setattr(os, "getuid", lambda: someone)
    assert not native.compile(cube()).from_cache


def test_a_disk_that_cannot_be_written_costs_only_time(monkeypatch: pytest.MonkeyPatch, tmp_path: Path):
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "file"))
    check(native.compile(cube()))


def test_a_full_disk_leaves_no_partial_file(empty_cache: Path, monkeypatch: pytest.MonkeyPatch):
    def full(_self: Path, _target: Path) -> Path:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Path, "replace", full)
    check(native.compile(cube()))
    assert list(empty_cache.iterdir()) == []


def test_the_least_recently_used_code_is_removed_first(empty_cache: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(cache, "KEPT_BYTES", 3 * (1000 + cache.DIGEST_BYTES))
    for name in ("first", "second", "third"):
        cache.write(name, bytes(1000))
    for age, name in enumerate(("third", "second", "first")):
        os.utime(empty_cache / name, (10**9 - age, 10**9 - age))
    assert cache.read("first") is not None
    cache.write("f0", bytes(1000))  # after a file with this ending the folder is looked through
    assert {path.name for path in empty_cache.iterdir()} == {"first", "third", "f0"}


def test_a_sixteenth_of_the_files_keeps_the_cache_within_its_size(empty_cache: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(cache, "KEPT_BYTES", 50 * (1000 + cache.DIGEST_BYTES))
    largest = 0
    for number in range(300):
        cache.write(cache.key(str(number)), bytes(1000))
        largest = max(largest, sum(1 for _ in empty_cache.iterdir()))
    assert 50 <= largest < 150


def test_without_a_compiler_the_virtual_machine_runs_and_says_so_once(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
):
    def nothing() -> None:
        raise KernelError("No native code on this computer: no wheel.")

    monkeypatch.setattr(object_code, "llvm", nothing)
    compilation.native_is_possible.cache_clear()
    try:
        for _ in range(2):
            compiled = compilation.compile(cube())
            assert compiled.engine == "virtual machine"
            check(compiled)
        assert len(caplog.records) == 1
        assert "No native code on this computer" in caplog.text
    finally:
        compilation.native_is_possible.cache_clear()


def test_the_virtual_machine_can_be_requested(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setenv(compilation.ENGINE_VARIABLE, "virtual-machine")
    compilation.native_is_possible.cache_clear()
    try:
        assert compilation.compile(cube()).engine == "virtual machine"
    finally:
        compilation.native_is_possible.cache_clear()
