"""The stage that makes the files for fabrication, and the verdicts on the lateral stiffness of the springs."""

from concurrent.futures import Executor, Future
from functools import partial

from mesh.housing.sweep import flexure_mesh
from pipeline.making.cad_tasks import write_fabrication_files
from pipeline.options import RunOptions
from pipeline.reading.pressed_sensor import PressedSensor
from pipeline.springs.fitted_springs import FittedSprings, height_difference_down, springs_to_read
from pipeline.springs.leaf_lengths import COARSE
from pipeline.springs.mounts import mount_layers
from pipeline.springs.spring import MadeSpring
from pipeline.storage.cache import load_or_compute
from pipeline.storage.kept_files import KeptFiles, begin_files
from pipeline.storage.workers import finished_future
from sensor.design.design_file import design_as_mapping
from sensor.design.signal_path import SpringReadOut
from sensor.quantity import Estimate
from sensor.verdict import Verdict, judge
from solve.housing.stiffness import sideways_stiffness

# Smallest accepted ratio of the stiffness across the plate to the stiffness along the press, by the name of the spring.
MIN_SIDEWAYS_RATIO = {"low": 3.0, "high": 1.2}


def begin_fabrication(sensor: PressedSensor, options: RunOptions, executor: Executor | None) -> Future[KeptFiles]:
    """Start making the files for fabrication, and return a future of them and of the verdicts on cover and bracket.

    The worker process of `executor` makes the files. If `executor` is None, this process makes them before the function
    returns. No files are made if fabrication is not requested, or if no housing can be made. The future then holds no
    files and no verdicts.

    OSError is raised if a file cannot be written, and ExportError if the volume read back from a file is wrong. If
    there is a worker, the future raises them. Raises InputError or SolveError if the press that limits the speed of a
    hand cannot be computed.
    """
    design, springs = sensor.design, sensor.springs
    housing = springs.housing
    if not options.fabrication or housing is None:
        return finished_future(KeptFiles())
    readable_springs = springs_to_read(springs)  # stiffness and deflection of each spring
    fastest_s = sensor.fastest_press_s  # shortest duration of a press by hand [s], or None without a read-out
    folder = "OUT" if options.out is None else str(options.out)
    difference = height_difference_down(springs)  # [mm]
    # The cache key is computed from these inputs, so they must include everything on which the files depend.
    inputs = {
        "design": design_as_mapping(design),
        "process": springs.process,
        "housing": housing,
        "springs": readable_springs,
        "fastest press": fastest_s,
        "folder": folder,
        "height difference": difference,
    }
    read_out = SpringReadOut(
        springs=readable_springs,
        signal=sensor.signal,
        bench=design.expected_bench,
        fastest_s=fastest_s,
        folder=folder,
        presses=1 if design.reading is None else int(design.reading.presses),
        height_difference_down=difference,
    )
    write = partial(write_fabrication_files, design, housing, read_out)
    return begin_files("maker files", inputs, write, executor)


def sideways_verdicts(springs: FittedSprings, options: RunOptions) -> tuple[Verdict, ...]:
    """Return a verdict for each spring on the ratio [1] of its lateral stiffness to its stiffness along the press.

    The lateral stiffness resists a push on the tip across the plate. Its error is the difference between the results on
    a fine and a coarse mesh, which are cached. No verdict is returned if fabrication is not requested, or if there is
    no housing. Raises SolveError if the housing cannot be solved.
    """
    housing = springs.housing
    process = springs.process
    if not options.fabrication or housing is None:
        return ()

    def solve_mesh(scale: float) -> tuple[float, ...]:
        """Return the lateral stiffness of each spring [N/mm], low first, on a mesh of this relative element size."""
        mesh = flexure_mesh(housing, scale)
        return sideways_stiffness(mesh, process.E_MPa, process.poisson, mount_layers(housing))

    def solve_both_meshes() -> dict[str, tuple[float, ...]]:
        return {"fine": solve_mesh(1.0), "coarse": solve_mesh(COARSE)}

    inputs = {"housing": housing, "E": process.E_MPa, "nu": process.poisson}
    K_by_mesh = load_or_compute("sideways", inputs, solve_both_meshes, dict[str, tuple[float, ...]])
    verdicts = []
    pairs = zip(K_by_mesh["fine"], K_by_mesh["coarse"], strict=True)
    for (name, spring), (fine_K, coarse_K) in zip(springs.springs.items(), pairs, strict=True):
        verdicts.append(sideways_verdict(name, spring, fine_K, abs(fine_K - coarse_K)))
    return tuple(verdicts)


def sideways_verdict(name: str, spring: MadeSpring, K: float, error: float) -> Verdict:
    """Return the verdict on the lateral stiffness `K` [N/mm] of a spring; `error` [N/mm] is the error of `K`."""
    ratio = Estimate(K / spring.stiffness, error / spring.stiffness)
    reference = "FE stiffness across the plate over that along the press; must be at least the limit"
    return judge(f"sideways.{name}", ratio, reference, limit=MIN_SIDEWAYS_RATIO[name])
