import small_gicp


def register(source, target, start):
    moving, fixed = small_gicp.PointCloud(source), small_gicp.PointCloud(target)
    return small_gicp.align(
        fixed, moving, small_gicp.KdTree(fixed), start, "ICP", max_correspondence_distance=2.6,
        max_iterations=20, rotation_epsilon=0.0, translation_epsilon=0.0,
    ).T_target_source
