"""Files of others, pinned by their hashes, with their licences; Node, which runs some of them."""
