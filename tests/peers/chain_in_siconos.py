"""A chain of masses between stops in Siconos: reads data from standard input, prints impacts and the last state.

Run by the Python of the operating system, for which Debian has Siconos; knows no other package of this project.
"""

import json
import sys

import numpy as np
from siconos import kernel  # type: ignore[import-not-found]


def main() -> None:
    """Run the chain that standard input describes: mass, damping, stiffness, q, v, gaps, restitution, seconds."""
    data = json.load(sys.stdin)
    mass, damping, stiffness = (np.array(data[name]) for name in ("mass", "damping", "stiffness"))
    chain = kernel.LagrangianLinearTIDS(data["q"], data["v"], mass, stiffness, damping)
    model = kernel.NonSmoothDynamicalSystem(0.0, data["seconds"])
    model.insertDynamicalSystem(chain)
    kept = []  # Siconos holds no references to parts that Python made
    for place, sign, gap in data["stops"]:
        row = np.zeros((1, len(mass)))
        row[0, place] = sign
        relation = kernel.LagrangianLinearTIR(row, [gap])
        law = kernel.NewtonImpactNSL(data["restitution"])
        contact = kernel.Interaction(law, relation)
        model.link(contact, chain)
        kept += [relation, law, contact]
    integrator = kernel.LsodarOSI()
    simulation = kernel.EventDriven(model, kernel.TimeDiscretisation(0.0, data["seconds"] / 200.0))
    simulation.insertIntegrator(integrator)
    for problem in (kernel.SICONOS_OSNSP_ED_IMPACT, kernel.SICONOS_OSNSP_ED_SMOOTH_ACC):
        kept.append(kernel.LCP())
        simulation.insertNonSmoothProblem(kept[-1], problem)
    integrator.setTol(1, data["tolerance"], data["tolerance"])
    impacts = []
    while simulation.hasNextEvent():
        simulation.advanceToEvent()
        if simulation.eventsManager().nextEvent().getType() == 2:  # not of the time grid
            impacts.append(simulation.nextTime())
        simulation.processEvents()
    end = {"impacts": impacts, "q": chain.q().tolist(), "v": chain.velocity().tolist(), "t": simulation.startingTime()}
    print(json.dumps(end))


if __name__ == "__main__":
    main()
