"""Drake: inverse dynamics of a MultibodyPlant."""

from importlib.metadata import version

import numpy as np

from peers.tasks.interface import BatchShape, Call, State, Task, imported, only, only_single
from peers.tasks.urdf_text import urdf_text


class Drake:
    """`CalcInverseDynamics`; position and velocity are set within the call, or Drake would reuse cached results."""

    name = "Drake"

    def version(self) -> str:
        """Return the version of the package."""
        return version("drake")

    def build(self, task: Task, batch: BatchShape | None) -> Call:
        """Build a call; the model is read from URDF text."""
        only(task, "rnea")
        only_single(batch)
        drake_plant, drake_parsing = imported("pydrake.multibody.plant"), imported("pydrake.multibody.parsing")
        forces_of = imported("pydrake.multibody.tree").MultibodyForces
        plant = drake_plant.MultibodyPlant(time_step=0.0)
        drake_parsing.Parser(plant).AddModelsFromString(urdf_text(task.tree), "urdf")
        plant.WeldFrames(plant.world_frame(), plant.GetFrameByName("base"))
        plant.Finalize()
        context, forces = plant.CreateDefaultContext(), forces_of(plant)
        n = plant.num_velocities()
        state_now, a = np.zeros(2 * n), np.zeros(n)
        results = {"tau": np.zeros(n)}

        def load(state: State) -> None:
            state_now[:n], state_now[n:], a[:] = state["q"], state["v"], state["a"]

        def run() -> None:
            plant.SetPositionsAndVelocities(context, state_now)
            plant.CalcForceElementsContribution(context, forces)
            results["tau"] = plant.CalcInverseDynamics(context, a, forces)

        return Call(load, run, lambda: results, (plant, context))
