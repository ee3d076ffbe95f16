import numpy as np
import open3d as o3d

registration = o3d.pipelines.registration


def register(source, target):
    o3d.utility.random.seed(0)
    moving, fixed = (o3d.geometry.PointCloud(o3d.utility.Vector3dVector(cloud)) for cloud in (source, target))
    pairs = o3d.utility.Vector2iVector(np.repeat(np.arange(len(source))[:, None], 2, axis=1))
    return registration.registration_ransac_based_on_correspondence(
        moving, fixed, pairs, max_correspondence_distance=0.2, ransac_n=3,
        criteria=registration.RANSACConvergenceCriteria(max_iteration=1000, confidence=0.99),
    ).transformation
