"""Maps of a field file that xarray reads piece by piece.

The file is open only during a read, as an open file would block a running run."""

from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray
from xarray.backends import BackendArray
from xarray.core.indexing import ExplicitIndexer, IndexingSupport, explicit_indexing_adapter


class SavedMap(BackendArray):
    """A map of shape (t, y, x) in a field file, restricted to the instants `saved`."""

    def __init__(self, dataset: h5py.Dataset, saved: NDArray[np.intp]) -> None:
        self.path, self.name, self.saved = dataset.file.filename, dataset.name, saved
        self.shape, self.dtype = (saved.size, *dataset.shape[1:]), dataset.dtype

    def __getitem__(self, key: ExplicitIndexer) -> Any:
        return explicit_indexing_adapter(key, self.shape, IndexingSupport.BASIC, self._read)

    def _read(self, key: tuple[int | slice, int | slice, int | slice]) -> NDArray[Any]:
        instants, *rest = key
        with h5py.File(self.path, "r") as file:
            dataset = file[self.name]
            if isinstance(instants, slice):
                pieces = [dataset[(number, *rest)] for number in self.saved[instants]]
                return np.stack(pieces) if pieces else np.empty(self.shape, self.dtype)[(instants, *rest)]
            return np.asarray(dataset[(self.saved[instants], *rest)])
