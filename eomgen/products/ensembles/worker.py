"""Code on the workers of a Dask cluster; imported if an ensemble is run on one, since Dask is optional."""

from __future__ import annotations

from distributed import Worker, WorkerPlugin

from eomgen.base.arrays import Array
from eomgen.errors import EomgenError
from eomgen.products.ensembles.parts import EnsemblePart, RemoteSource, WorkerState

#: Ensembles with parts on this worker, by identity.
_ROOMS: dict[str, WorkerState] = {}


class SourceDelivery(WorkerPlugin):
    """Plugin of Dask that brings the source of an ensemble's samples to each worker, also to workers that join later,
    and removes it at the end."""

    def __init__(self, shipment: RemoteSource) -> None:
        self._shipment = shipment
        self.name = shipment.ensemble

    def setup(self, worker: Worker) -> None:
        """Called by a worker that is given the shipment."""
        _ROOMS[self.name] = WorkerState(self._shipment)

    def teardown(self, worker: Worker) -> None:
        """Called by a worker when the ensemble has ended: samples under way are given up."""
        if (room := _ROOMS.pop(self.name, None)) is not None:
            room.stop.set()


def run_part(ensemble: str, first: int, values: Array) -> EnsemblePart | EomgenError | None:
    """Run samples with values (n, d) on this worker; raise LookupError if the shipment is missing."""
    return _ROOMS[ensemble].run(first, values)
