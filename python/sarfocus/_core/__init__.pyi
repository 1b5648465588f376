from . import adaptive as adaptive
from . import autofocus as autofocus
from . import detect as detect
from . import focus as focus
from . import geometry as geometry
from . import hrws as hrws
from . import quality as quality
from . import signal as signal
from . import sim as sim
from . import strip as strip

__version__: str

class NumericalError(ValueError): ...
class ShapeError(ValueError): ...
class MemoryEstimateError(MemoryError): ...
class Cancelled(RuntimeError): ...

def available_memory() -> int: ...
def thread_count(threads: int = 0) -> int: ...
