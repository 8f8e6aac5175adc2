"""Writes the files beside it: the record of `files.rs` as scipy, h5py and nptdms write it (pip install scipy h5py nptdms)."""

import h5py
import numpy as np
import scipy.io
from nptdms import ChannelObject, TdmsWriter

time, drive, place, play = [], [], [], 0.0
for k in range(240):
    phase = float(k % 80)
    volts = 2.5 * (phase if phase < 40.0 else 80.0 - phase) - 20.0
    play = min(max(play, volts - 4.0), volts + 4.0)
    time.append(k * 1e-3)
    drive.append(volts)
    place.append(0.25 * volts + 0.125 * play + 0.5)
columns = {"time_s": np.array(time), "drive_V": np.array(drive), "displacement_um": np.array(place)}
more = {"gain": np.array([20.0]), "operator": "nobody"}

scipy.io.savemat("v5.mat", {**columns, **more}, do_compression=True)
scipy.io.savemat("v5-plain.mat", columns, do_compression=False, oned_as="column")
with h5py.File("record.h5", "w") as file:
    group = file.create_group("scan 1")
    for name, values in columns.items():
        group.create_dataset(name, data=values, chunks=(64,), compression="gzip", shuffle=True)
    group["gain"] = 20.0
    file["comment"] = "nobody"
with h5py.File("v7.3.mat", "w", userblock_size=512) as file:
    for name, values in columns.items():
        file[name] = values.reshape(1, -1)
        file[name].attrs["MATLAB_class"] = np.bytes_("double")
with open("v7.3.mat", "r+b") as file:
    file.write(b"MATLAB 7.3 MAT-file, Platform: GLNXA64, Created on: Mon Nov 23 2026 HDF5 schema 1.00 .".ljust(116))
    file.seek(124)
    file.write(b"\x00\x02IM")
with TdmsWriter("record.tdms") as writer:
    for first in range(0, 240, 100):
        writer.write_segment(
            [ChannelObject("scan", name, values[first : first + 100]) for name, values in columns.items()]
        )
