"""Run `python -m wavetank`."""

from wavetank.cli import main

main()
