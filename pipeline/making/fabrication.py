"""Files for a maker beside the part: drawing, coupon, cover and sheet; verdicts on cover and sideways stiffness."""

from concurrent.futures import Executor, Future
from functools import partial

from mesh.housing.sweep import flexure_mesh
from pipeline.making.cad_tasks import write_fabrication_files
from pipeline.options import RunOptions
from pipeline.reading.pressed_sensor import PressedSensor
from pipeline.springs.fitted_springs import FittedSprings, springs_to_read
from pipeline.springs.leaf_lengths import COARSE
from pipeline.springs.mounts import mount_layers
from pipeline.springs.spring import MadeSpring
from pipeline.storage.cache import cached
from pipeline.storage.kept_files import KeptFiles, begin_files
from pipeline.storage.workers import finished_future
from sensor.design.design_file import design_as_mapping
from sensor.design.signal_path import SpringReadOut
from sensor.quantity import Estimate
from sensor.verdict import Verdict, judge
from solve.housing.stiffness import sideways_stiffness

SIDEWAYS_LEAST = {"low": 3.0, "high": 1.2}  # least stiffness across the plate over the stiffness along the press


def begin_fabrication(sensor: PressedSensor, options: RunOptions, executor: Executor | None) -> Future[KeptFiles]:
    """Begin the files for fabrication; the future gives the files with the verdicts on cover and bracket.

    It gives none if fabrication was not requested, or no housing can be made. The future raises OSError if a file
    cannot be written, and ExportError if a file has another volume when read back.
    """
    design, springs = sensor.design, sensor.springs
    housing = springs.housing
    if not options.fabrication or housing is None:
        return finished_future(KeptFiles())
    to_read = springs_to_read(springs)
    fastest_s = sensor.fastest_press_s
    folder = "OUT" if options.out is None else str(options.out)
    inputs = {
        "design": design_as_mapping(design),
        "process": springs.process,
        "housing": housing,
        "springs": to_read,
        "fastest press": fastest_s,
        "folder": folder,
    }
    bench = design.expected_bench
    read_out = SpringReadOut(springs=to_read, signal=sensor.signal, bench=bench, fastest_s=fastest_s, folder=folder)
    write = partial(write_fabrication_files, design, housing, read_out)
    return begin_files("maker files", inputs, write, executor)


def sideways_verdicts(springs: FittedSprings, options: RunOptions) -> tuple[Verdict, ...]:
    """Return the verdicts on the stiffness across the plate over the stiffness along the press [1].

    Empty unless fabrication is requested. The error is the difference between two meshes. Raises SolveError.
    """
    housing = springs.housing
    process = springs.process
    if not options.fabrication or housing is None:
        return ()

    def stiffnesses(scale: float) -> tuple[float, ...]:
        mesh = flexure_mesh(housing, scale)
        return sideways_stiffness(mesh, process.E_MPa, process.poisson, mount_layers(housing))

    def on_both_meshes() -> dict[str, tuple[float, ...]]:
        return {"fine": stiffnesses(1.0), "coarse": stiffnesses(COARSE)}

    inputs = {"housing": housing, "E": process.E_MPa, "nu": process.poisson}
    on_mesh = cached("sideways", inputs, on_both_meshes, dict[str, tuple[float, ...]])
    verdicts = []
    rows = zip(springs.springs.items(), on_mesh["fine"], on_mesh["coarse"], strict=True)
    for (name, spring), fine, coarse in rows:
        verdicts.append(sideways_verdict(name, spring, fine, abs(fine - coarse)))
    return tuple(verdicts)


def sideways_verdict(name: str, spring: MadeSpring, K: float, error: float) -> Verdict:
    """Return the verdict on one sideways stiffness [N/mm]; its error [N/mm] is the difference from a coarser mesh."""
    ratio = Estimate(K / spring.stiffness, error / spring.stiffness)
    words = "FE stiffness across the plate over that along the press; must be at least the limit"
    return judge(f"sideways.{name}", ratio, words, limit=SIDEWAYS_LEAST[name])
