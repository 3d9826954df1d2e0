"""Names of types: what the functions of this package take and return."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]
Values = float | Array
ComplexValues = complex | Array | ComplexArray
