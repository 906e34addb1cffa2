"""MuJoCo: inverse dynamics of the simulator."""

from functools import partial

from peers.tasks.interface import BatchShape, Call, Missing, Task, copy_into, imported, only
from peers.tasks.urdf_text import urdf_text


class Mujoco:
    """`mj_inverse`, with constraints switched off: the model has no contacts and no limits."""

    name = "MuJoCo"

    def version(self) -> str:
        """Return the version of the engine."""
        return imported("mujoco").__version__

    def build(self, task: Task, batch: BatchShape | None) -> Call:
        """Build a call; the model is read from URDF text."""
        only(task, "rnea")
        if batch is not None:
            raise Missing("mujoco.batch steps and has no inverse dynamics")
        mujoco = imported("mujoco")
        model = mujoco.MjModel.from_xml_string(urdf_text(task.tree))
        model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONSTRAINT
        data = mujoco.MjData(model)
        inputs = {"q": data.qpos, "v": data.qvel, "a": data.qacc}
        run = partial(mujoco.mj_inverse, model, data)
        return Call(partial(copy_into, inputs), run, lambda: {"tau": data.qfrc_inverse.copy()}, (model, data))
