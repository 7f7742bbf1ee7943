"""Turns a bass into what other programs play: sample packs."""
