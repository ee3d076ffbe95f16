"""Parts that several figures share: placing a cloud by hand, the field behind a map, a room seen from above."""
