"""The kernels' machine layer: memory at addresses, instructions, and bit-exact sines."""
