"""The whole run in one picture, for a README or a slide."""

from pathlib import Path

from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine

from exograv.errors import RecordingError
from exograv.recording import Recording, read_recording
from exograv.report.figures.left_over import CLOSE_UP, plot_bars
from exograv.report.figures.postures import distinct_frames, plot_posture
from exograv.report.figures.progress import plot_progress
from exograv.report.style.figure_style import house_style
from exograv.study.targets import targets

POSTURES = 3
DOTS_PER_INCH = 110


def write_summary_picture(recording_path: Path, png_path: Path) -> Path:
    """Draw postures, progress and what is left over side by side.

    Args:
        recording_path: A complete recording of `demo`.
        png_path: The picture to write, or to replace; its folder is created too.

    Returns:
        `png_path`.

    Raises:
        RecordingError: The recording cannot be read, lacks what the picture shows, or the picture cannot be written.
    """
    recording = read_recording(recording_path)
    try:
        png_path.parent.mkdir(parents=True, exist_ok=True)
        with house_style():
            _draw(recording).savefig(png_path, dpi=DOTS_PER_INCH, metadata={"Software": None})
    except OSError as error:
        raise RecordingError(f"The picture {png_path} cannot be written: {error.strerror}.") from error
    return png_path


def _draw(recording: Recording) -> Figure:
    frames = distinct_frames(recording.messages("/skeleton"), POSTURES)
    total = (recording.last("/result").get("left_over_rms_Nm") or {}).get("total")
    if not frames or not total or len(recording.messages("/left_over")) < 2:
        raise RecordingError(
            f"{recording.path} lacks /skeleton, /left_over or the left over in /result; the summary picture needs a "
            "complete recording of `exograv demo`."
        )
    figure = Figure(figsize=(13.0, 3.9), layout=ConstrainedLayoutEngine(w_pad=0.1, h_pad=0.1))
    body, progress, bars = figure.subplots(1, 3, width_ratios=(0.8, 1.2, 1.2))
    for k, frame in enumerate(frames):
        plot_posture(body, frame, recording.settings.get("side", "right"), (k + 1) / len(frames), body=k == 0)
    handles, labels = body.get_legend_handles_labels()
    body.legend(handles[-2:], labels[-2:], loc="upper center", bbox_to_anchor=(0.5, 0.02), ncols=2, fontsize=8)
    body.set_title("The arm in the exoskeleton")
    plot_progress(progress, recording)
    progress.set_title("Learning the weight of the arm")
    goal = targets(recording)
    plot_bars(bars, recording.joints, total, goal, top=CLOSE_UP * float(goal.max()))
    bars.set_title("Left over at unseen postures [N·m]")
    bars.legend(
        loc="upper center", bbox_to_anchor=(0.5, -0.13), ncols=4, fontsize=7.5, columnspacing=1.2, handlelength=1.4
    )
    return figure
