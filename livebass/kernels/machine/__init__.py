"""What kernels share with the machine: memory at addresses, its instructions, and sines to the bit."""
