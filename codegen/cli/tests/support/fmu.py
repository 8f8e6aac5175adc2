"""Validates units with fmpy and connects two of them, tick by tick: a controller, its plant, a file of input words of the controller
(64 bits each, native order), ticks, a file for what comes of it, the tick at which the plant
begins to move (`specgen sim --record` arms before): in each tick the inputs as they were, then the outputs, as words.
What the plant gives is taken from the plant, the rest of the inputs from the file. A second plant runs beside the first with another
seed, in the same process."""

import shutil
import struct
import sys

from fmpy import extract, read_model_description
from fmpy.fmi2 import FMU2Slave
from fmpy.validation import validate_fmu


def instance(path: str, name: str):
    findings = validate_fmu(path)
    assert not findings, findings
    about = read_model_description(path)
    folder = extract(path)
    unit = FMU2Slave(
        guid=about.guid, unzipDirectory=folder, modelIdentifier=about.coSimulation.modelIdentifier, instanceName=name
    )
    unit.instantiate()
    unit.setupExperiment(startTime=0.0)
    unit.enterInitializationMode()
    return unit, about, folder


def main(controller_path: str, plant_path: str, inputs_path: str, ticks: int, out_path: str, first: int) -> None:
    controller, about, first_folder = instance(controller_path, "controller")
    plant, plant_about, second_folder = instance(plant_path, "plant")
    other, _, third_folder = instance(plant_path, "other")
    of_plant = {variable.name: variable.valueReference for variable in plant_about.modelVariables}
    other.setInteger([of_plant["settings.seed"]], [2])
    of_controller = {variable.name: variable.valueReference for variable in about.modelVariables}
    # `specgen sim` gives legs without a platform displacements, whatever the spec's set-points are.
    if "settings.setpoint_kind" in of_controller:
        controller.setInteger([of_controller["settings.setpoint_kind"]], [1])
    for unit in (controller, plant, other):
        unit.exitInitializationMode()
    period = float(about.defaultExperiment.stepSize)
    inputs = [variable for variable in about.modelVariables if variable.causality == "input"]
    outputs = [variable for variable in about.modelVariables if variable.causality == "output"]
    readings = {k: of_plant[v.name] for k, v in enumerate(inputs) if v.name in of_plant}
    voltages = [of_plant[f"voltage[{leg}]"] for leg in range(6)]
    own = {variable.name: variable.valueReference for variable in outputs}
    given = [own[f"voltage[{leg}]"] for leg in range(6)]
    seeds_differ = False

    def as_word(value, variable) -> int:
        if variable.type == "Real":
            return struct.unpack("=Q", struct.pack("=d", value))[0]
        return value & 0xFFFF_FFFF

    with open(inputs_path, "rb") as file, open(out_path, "wb") as out:
        for tick in range(ticks):
            row = struct.unpack(f"={len(inputs)}Q", file.read(8 * len(inputs)))
            seen = dict(zip(readings, plant.getReal(list(readings.values()))))
            seeds_differ |= list(seen.values()) != other.getReal(list(readings.values()))
            words = []
            for k, (variable, word) in enumerate(zip(inputs, row)):
                if variable.type == "Real":
                    # Until the plant moves, the gauges show what the check of the wiring is to see.
                    moves = k in seen and tick >= first
                    value = seen[k] if moves else struct.unpack("=d", struct.pack("=Q", word))[0]
                    controller.setReal([variable.valueReference], [value])
                else:
                    value = struct.unpack("=i", struct.pack("=I", word))[0]
                    controller.setInteger([variable.valueReference], [value])
                words.append(as_word(value, variable))
            controller.doStep(currentCommunicationPoint=tick * period, communicationStepSize=period)
            for variable in outputs:
                get = controller.getReal if variable.type == "Real" else controller.getInteger
                words.append(as_word(get([variable.valueReference])[0], variable))
            out.write(struct.pack(f"={len(words)}Q", *words))
            for unit in (plant, other) if tick >= first else ():
                unit.setReal(voltages, controller.getReal(given))
                unit.doStep(currentCommunicationPoint=(tick - first) * period, communicationStepSize=period)
    assert seeds_differ, "two plants with two seeds are the same"
    for unit, folder in ((controller, first_folder), (plant, second_folder), (other, third_folder)):
        unit.terminate()
        unit.freeInstance()
        shutil.rmtree(folder, ignore_errors=True)


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2], sys.argv[3], int(sys.argv[4]), sys.argv[5], int(sys.argv[6]))
