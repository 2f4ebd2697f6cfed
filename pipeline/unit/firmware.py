from pipeline.unit.measuring import MeasuringUnit


def c_header(s: MeasuringUnit) -> str:
    return ""


def micropython(s: MeasuringUnit) -> str:
    return ""
