"""A bass as a plugin of other programs: instrument files, the shells that hosts load, bundles of both."""
