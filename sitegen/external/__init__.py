"""Third-party files, pinned by their hashes, with their licences; and Node, which runs some of them."""
