"""OpenABF's benchmarks of angle based flattening on surfaces by formula."""
