"""What runs on the workers of a Dask cluster; imported where an ensemble is run on one, since Dask is optional."""

from __future__ import annotations

from distributed import Worker, WorkerPlugin

from eomgen.arrays import Array
from eomgen.ensembles.parts import Part, Refusal, Room, Shipment

#: Ensembles that this worker runs parts of, by what tells them from others.
_ROOMS: dict[str, Room] = {}


class Delivery(WorkerPlugin):
    """Brings a shipment to each worker once, also to those that join later, and clears up after it."""

    def __init__(self, shipment: Shipment) -> None:
        self._shipment = shipment
        self.name = shipment.ensemble

    def setup(self, worker: Worker) -> None:
        """Called by a worker that is given the shipment."""
        _ROOMS[self.name] = Room(self._shipment)

    def teardown(self, worker: Worker) -> None:
        """Called by a worker when the ensemble has ended: samples under way are given up."""
        if (room := _ROOMS.pop(self.name, None)) is not None:
            room.stop.set()


def run_part(ensemble: str, first: int, values: Array) -> Part | Refusal | None:
    """Run samples with values (n, d) on this worker; raise LookupError where the shipment is not there."""
    return _ROOMS[ensemble].run(first, values)
