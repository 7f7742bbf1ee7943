# tools/check, tools/demo and tools/test source this in the project directory: `make_venv` leaves a working .venv there.

bytecode=$PWD/.venv/pycache # of tests and all that they import

say() { printf '%s\n' "$*" >&2; }

# Finds the first of the usual names that starts Python 3.11 or later.
find_python() {
    for candidate in ${PYTHON:+"$PYTHON"} python3.13 python3.12 python3.11 python3.14 python3 python; do
        if "$candidate" -c 'import sys; sys.exit(sys.version_info < (3, 11))' >/dev/null 2>&1; then
            printf '%s\n' "$candidate"
            return 0
        fi
    done
    return 1
}

make_venv() {
    # Replaces one that was moved, is incomplete, or has an older Python.
    if .venv/bin/python -c 'import sys, pip; sys.exit(sys.version_info < (3, 11))' >/dev/null 2>&1; then
        return 0
    fi
    if ! python=$(find_python); then
        say "This needs Python 3.11 or later, and there is none on the PATH (PYTHON=/path/to/python3 names one)."
        say "  Debian 12 or later:  sudo apt install python3 python3-venv"
        say "  macOS:               brew install python@3.12, or the installer from python.org"
        return 1
    fi
    if ! "$python" -c 'import ensurepip, venv' >/dev/null 2>&1; then
        version=$("$python" -c 'import sys; print("%d.%d" % sys.version_info[:2])')
        say "$python cannot make virtual environments: its venv module is not complete."
        say "  Debian, Ubuntu:  sudo apt install python3-venv   (or python$version-venv)"
        return 1
    fi
    say "Making .venv with $("$python" --version) ..."
    "$python" -m venv --clear .venv
}

pip_install() {
    if ! .venv/bin/python -m pip install --quiet --disable-pip-version-check "$@"; then
        say "Installing failed; what is above says why. It needs the network the first time."
        return 1
    fi
}

# Installs the project and its tests' requirements, unless .venv has them already.
install_tests() {
    asked="$(pwd) $(cksum <pyproject.toml)"
    if [ "$(cat .venv/installed 2>/dev/null)" = "$asked" ]; then
        return 0
    fi
    PYTHONPYCACHEPREFIX=$bytecode pip_install --editable '.[test]' # pip compiles for the first run of the tests
    printf '%s\n' "$asked" >.venv/installed
}
