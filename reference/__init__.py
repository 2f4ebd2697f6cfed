"""Published solutions and independent programs that tests, benchmarks and documents compare the product with."""
