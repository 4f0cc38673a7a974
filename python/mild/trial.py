"""`python -m mild.trial`: the command of mild.trials. Where it is imported, it takes the place of the function mild.trial, so it can be called."""
import sys
import types

from .trials import main, trial


class _Callable(types.ModuleType):
    __call__ = staticmethod(trial)


sys.modules[__name__].__class__ = _Callable

if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
