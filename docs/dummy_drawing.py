"""Draw the dummy arm of an acceptance from its file: `python docs/dummy_drawing.py` writes pictures/dummy.svg."""

from pathlib import Path

from exograv.procedures.acceptance.dummy import LIMB, Dummy, DummyPart, load_dummy

FILE = Path(__file__).parent / "pictures" / "dummy.svg"

SCALE = 1000.0  # px/m
LEFT, TOP, GAP, WIDE = 60.0, 80.0, 230.0, 860.0
TITLES = {"upper_arm": "Upper arm, from the shoulder joint", "forearm": "Forearm, from the elbow hinge"}
FILLS = {"tube": "#E3E8EC", "shell for the cuff": "#56B4E9", "hook": "#E69F00"}
OTHER = "#8B96A1"


def drawing(dummy: Dummy) -> str:
    """Return the drawing as SVG: both limbs lie along x, with place and mass of each part."""
    rows = [_limb(dummy, number) for number in range(len(LIMB))]
    tall = TOP + GAP * len(LIMB)
    head = (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDE:g} {tall:g}" font-family="sans-serif" '
        'font-size="11" fill="#22303C">'
    )
    return "\n".join([head, '<rect width="100%" height="100%" fill="white"/>', *rows, "</svg>", ""])


def _limb(dummy: Dummy, number: int) -> str:
    segment, axis = LIMB[number], TOP + GAP * number + 40.0
    parts = dummy.parts_of(segment)
    mass = sum(part.mass_kg for part in parts)
    centre = sum(part.mass_kg * part.at_m for part in parts) / mass
    length = getattr(dummy.settings.lengths_m, segment)
    title = f"{TITLES[segment]}: {mass:.3f} kg, centre of mass at {1e3 * centre:.0f} mm"
    lines = [f'<text x="{LEFT:g}" y="{axis - 65:.0f}" font-weight="bold">{title}</text>']
    tubes_first = sorted(parts, key=lambda part: part.name != "tube")
    lines += [_shape(part, axis) for part in tubes_first]
    lines += [_label(part, axis, row) for row, part in enumerate(sorted(parts, key=lambda part: part.at_m))]
    for at, name in ((0.0, "joint"), (length, "elbow hinge" if segment == "upper_arm" else "wrist")):
        x = LEFT + SCALE * at
        lines.append(f'<path d="M{x:.1f} {axis - 52:.0f}V{axis + 52:.0f}" stroke="#D55E00" stroke-dasharray="6 3"/>')
        lines.append(f'<text x="{x + 3:.1f}" y="{axis - 46:.0f}" fill="#D55E00">{name}, {1e3 * at:.0f} mm</text>')
    return "\n".join(lines)


def _shape(part: DummyPart, axis: float) -> str:
    x, wide, tall = (
        LEFT + SCALE * (part.at_m - 0.5 * part.length_m),
        SCALE * part.length_m,
        1e-3 * SCALE * part.outer_mm,
    )
    fill = FILLS.get(part.name, OTHER)
    return (
        f'<rect x="{x:.1f}" y="{axis - 0.5 * tall:.1f}" width="{wide:.1f}" height="{tall:.1f}" fill="{fill}" '
        'fill-opacity="0.85" stroke="#22303C" stroke-width="0.8"/>'
    )


def _label(part: DummyPart, axis: float, row: int) -> str:
    x, y = LEFT + SCALE * part.at_m, axis + 62.0 + 14.0 * row
    bore = f" / {part.inner_mm:g}" if part.inner_mm else ""
    size = f"Ø {part.outer_mm:g}{bore}, {1e3 * part.length_m:g} long"
    text = f"{part.name}: {part.mass_kg:g} kg at {1e3 * part.at_m:g} mm, {size}"
    return (
        f'<path d="M{x:.1f} {axis:.1f}V{y - 4:.1f}H{LEFT + 400:.0f}" fill="none" stroke="#8B96A1" stroke-width="0.5"/>'
        f'<text x="{LEFT + 404:.0f}" y="{y:.1f}">{text}</text>'
    )


def main() -> None:
    """Write the drawing of the shipped dummy."""
    FILE.write_text(drawing(load_dummy()), encoding="utf-8")


if __name__ == "__main__":
    main()
