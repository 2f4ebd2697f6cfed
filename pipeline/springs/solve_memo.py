"""The solves of one fit: the last mesh and solution at each scale, so that no step is solved twice."""

import dataclasses
import time
from concurrent.futures import Executor, Future
from dataclasses import dataclass, field

from cad.parts.housing import Housing, PartSize
from mesh.housing.sweep import FlexureMesh, check_flexure_mesh, flexure_mesh, stretched
from pipeline.springs.mesh_pairs import MeshPair
from pipeline.springs.mounts import attached_to
from pipeline.springs.solid_size import solid_size
from solve.housing.stiffness import HousingStiffness, TipCompliance, housing_stiffness, tip_compliance


@dataclass(frozen=True, kw_only=True)
class FittedHousing:
    """A housing [mm] with its stiffness; `solves` counts those on its own mesh and all others, `seconds` by step."""

    housing: Housing
    stiffness: HousingStiffness
    solves: tuple[int, int]
    seconds: dict[str, float]


@dataclass
class SolveMemo:
    """The last mesh and solution of a housing at each scale, so that no step is solved twice, and what they cost."""

    E: float
    poisson: float
    executor: Executor | None = None
    counts: dict[float, int] = field(default_factory=dict)
    seconds: dict[str, float] = field(default_factory=lambda: {"mesh": 0.0, "solve": 0.0, "compare": 0.0})
    meshes: dict[float, tuple[Housing, FlexureMesh]] = field(default_factory=dict)
    solutions: dict[float, tuple[Housing, TipCompliance]] = field(default_factory=dict)
    solid: tuple[Housing, Future[PartSize]] | None = None

    def solve(self, housing: Housing, scale: float, *, stretch: bool = False) -> TipCompliance:
        """Return the compliance [mm/N] on a mesh of a scale; with `stretch` on the last one, if it stretches."""
        if scale in self.solutions and self.solutions[scale][0] == housing:
            return self.solutions[scale][1]
        start = time.perf_counter()
        mesh = self._stretched(housing, scale) if stretch else None
        if mesh is None:
            mesh = flexure_mesh(housing, scale)
        self.meshes[scale] = housing, mesh
        meshed = time.perf_counter()
        compliance = tip_compliance(mesh, self.E, self.poisson, attached_to(housing))
        self.solutions[scale] = housing, compliance
        self.counts[scale] = self.counts.get(scale, 0) + 1
        self.seconds["mesh"] += meshed - start
        self.seconds["solve"] += time.perf_counter() - meshed
        return compliance

    def _stretched(self, housing: Housing, scale: float) -> FlexureMesh | None:
        if scale not in self.meshes:
            return None
        before, mesh = self.meshes[scale]
        return stretched(mesh, before, housing)

    def begin_solid(self, housing: Housing) -> None:
        """Let a worker, if there is one, make the solid beside the solves that come."""
        if self.executor is not None and (self.solid is None or self.solid[0] != housing):
            self.solid = housing, self.executor.submit(solid_size, housing)

    def _size_of_solid(self, housing: Housing) -> PartSize:
        self.begin_solid(housing)
        return solid_size(housing) if self.solid is None else self.solid[1].result()

    def stiffness(self, housing: Housing, pair: MeshPair, coarse: TipCompliance | None = None) -> HousingStiffness:
        """Return the stiffness [N/mm] with its bars; the coarse mesh is solved unless its result is given."""
        self.begin_solid(housing)
        stiffness = housing_stiffness(self.solve(housing, pair.fine), coarse or self.solve(housing, pair.coarse))
        info = stiffness.info
        status = f"mesh of scale {pair.fine:g} judged by scale {pair.coarse:g} ({info.status})"
        return dataclasses.replace(
            stiffness, error=pair.errors(housing, stiffness.error), info=dataclasses.replace(info, status=status)
        )

    def fitted(self, housing: Housing, pair: MeshPair, coarse: TipCompliance | None = None) -> FittedHousing:
        """Return the housing with its stiffness [N/mm], its mesh compared with its solid; raises MeshError."""
        stiffness = self.stiffness(housing, pair, coarse)
        start = time.perf_counter()
        check_flexure_mesh(self.meshes[pair.fine][1], self._size_of_solid(housing))
        self.seconds["compare"] += time.perf_counter() - start
        fine = self.counts[pair.fine]
        info = dataclasses.replace(stiffness.info, seconds=sum(self.seconds.values()))
        return FittedHousing(
            housing=housing,
            stiffness=dataclasses.replace(stiffness, info=info),
            solves=(fine, sum(self.counts.values()) - fine),
            seconds=dict(self.seconds),
        )
