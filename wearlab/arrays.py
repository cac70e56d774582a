"""What arrays hold, one name a kind of number; and where random numbers come from."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Index = NDArray[np.int64]
Flags = NDArray[np.bool_]
Complex = NDArray[np.complex128]
Random = np.random.Generator
