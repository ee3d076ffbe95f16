"""What several figures have in common: clouds put by hand, a map's field, a room seen from above."""
