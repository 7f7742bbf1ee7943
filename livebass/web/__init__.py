"""A web page that plays basses: the kernels as WebAssembly, instrument files, and the JavaScript around them."""
