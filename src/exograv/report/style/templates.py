"""How every page of ours is filled in: letters of HTML are escaped, and a name that is missing is an error."""

import jinja2


def template(name: str, *packages: str) -> jinja2.Template:
    """The template of this name, looked for in these packages in their order, as are those that it builds on."""
    environment = jinja2.Environment(
        loader=jinja2.ChoiceLoader([jinja2.PackageLoader(package, ".") for package in packages]),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    return environment.get_template(name)
