"""`python -m livebass`."""

from livebass.cli import main

main()
