"""Set-ups and tools shared by the tests of several rooms."""
