"""Turns a bass into a plugin for hosts: instrument files, the shells that hosts load, and bundles of both."""
