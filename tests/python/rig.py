# SPDX-License-Identifier: GPL-2.0-or-later
"""What the tests of the Python package share: where it is, and an exception that is expected."""
import contextlib
import os
import pathlib
import sys

PACKAGE = str(pathlib.Path(__file__).resolve().parents[2] / "python")
sys.path.insert(0, PACKAGE)
os.environ["POKEYS_SHM_LIBRARY"] = next(str(pathlib.Path(path).resolve()) for path in sys.argv if ".so" in path)


@contextlib.contextmanager
def raises(kind, text=""):
    """Fails unless this exception comes, with this text in it."""
    try:
        yield
    except kind as error:
        assert text in str(error), error
    else:
        raise AssertionError(f"no {kind.__name__}")
