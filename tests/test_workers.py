"""Processes beside this one end at once when the work is given up, even in the middle of an answer.

Mutant killed: our end of the answers' pipe left open; then whoever reads it waits for the rest of an answer for ever.
"""

import subprocess
import sys

SCRIPT = """
import threading
import time

from cyclopean.cli.workers import beside


def main():
    for k in range(6):
        try:
            with beside(1) as executor:
                executor.submit(abs, -1).result()
                executor.submit(bytes, 200_000_000)
                time.sleep(0.1 + 0.09 * k)
                raise KeyboardInterrupt
        except KeyboardInterrupt:
            pass
    deadline = time.monotonic() + 20.0
    while threading.active_count() > 1 and time.monotonic() < deadline:
        time.sleep(0.05)
    print(threading.active_count())


if __name__ == "__main__":
    main()
"""


def test_nobody_waits_for_the_rest_of_an_answer(tmp_path):
    """An answer of 200 MB is on its way at one of six moments; afterwards no thread is left that reads."""
    (tmp_path / "work.py").write_text(SCRIPT)
    done = subprocess.run(
        [sys.executable, str(tmp_path / "work.py")], capture_output=True, text=True, timeout=120, check=False
    )
    assert done.stdout == "1\n", done.stderr
