#!/bin/sh
# tools/demo, tools/test and the other commands call this: it finds Python 3.11 or later and starts `run.py` with it.
set -eu

usable() {
    "$1" -c 'import sys; sys.exit(sys.version_info < (3, 11))' >/dev/null 2>&1
}

# Newest first, as far as livebass was tried; `python3` last, which may be newer than what all packages support
for python in ${PYTHON:+"$PYTHON"} python3.14 python3.13 python3.12 python3.11 python3 python; do
    if usable "$python"; then
        exec "$python" "$(dirname "$0")/run.py" "$@"
    fi
done
cat >&2 <<END
This needs Python 3.11 or later, and there is none on the PATH (PYTHON=/path/to/python3 names one).
  Debian 12, Ubuntu 24.04 or later:  sudo apt install python3 python3-venv
  macOS:                             brew install python, or the installer from python.org
END
exit 1
