"""Makes the MAT-file v7.3 of the import's tests: the variables of `plain.mat`, so that it holds the numbers of `plain.csv`.

    pip install scipy==1.17.1 hdf5storage==0.2.2 h5py==3.16.0 && python v73.py
"""

from pathlib import Path

import h5py
import hdf5storage
import numpy as np
from scipy.io import loadmat

HERE = Path(__file__).parent
flight = {name: value for name, value in loadmat(HERE / "plain.mat").items() if not name.startswith("__")}
file = HERE / "v73.mat"
file.unlink(missing_ok=True)
hdf5storage.savemat(str(file), flight, format="7.3", matlab_compatible=True, oned_as="column")
# What MATLAB writes and hdf5storage does not: a sparse matrix.
with h5py.File(file, "a") as written:
    sparse = written.create_group("sparse")
    sparse.attrs["MATLAB_sparse"] = np.uint64(3)
    sparse.attrs["MATLAB_class"] = np.bytes_("double")
    sparse["data"], sparse["ir"], sparse["jc"] = np.ones(2), np.arange(2), np.arange(4)

# References that lead round in a circle, twice at each turn.
with h5py.File(HERE / "round.mat", "w", userblock_size=512) as written:
    refs = written.create_group("#refs#")
    both = refs.create_dataset("a", (2,), dtype=h5py.ref_dtype)
    both[:] = [both.ref, both.ref]
    written.create_dataset("list/field", data=[both.ref, both.ref], dtype=h5py.ref_dtype)
with open(HERE / "round.mat", "r+b") as written:
    written.write(b"MATLAB 7.3 MAT-file")
