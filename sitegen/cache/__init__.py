"""What is kept between builds: files by the hash of what made them, and the processes that make them ahead."""
