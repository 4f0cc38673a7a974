"""`python -m mild.trial`: the command of mild.trials."""
import sys

from .trials import main

if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
