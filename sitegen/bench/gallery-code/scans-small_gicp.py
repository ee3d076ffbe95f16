import small_gicp


def register(source, target, start):
    fixed = small_gicp.PointCloud(target)
    result = small_gicp.align(
        fixed, small_gicp.PointCloud(source), small_gicp.KdTree(fixed), start,
        registration_type="ICP", max_correspondence_distance=2.6,
        max_iterations=20, rotation_epsilon=0.0, translation_epsilon=0.0,
    )
    return result.T_target_source
