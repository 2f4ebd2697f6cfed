"""Published solutions and independent programs with which tests, benchmarks and documents compare the product."""
