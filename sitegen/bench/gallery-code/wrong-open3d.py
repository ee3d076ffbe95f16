import numpy as np
import open3d as o3d

registration = o3d.pipelines.registration


def cloud(points):
    return o3d.geometry.PointCloud(o3d.utility.Vector3dVector(points))


def register(source, target):
    o3d.utility.random.seed(0)
    rows = np.arange(len(source))
    pairs = o3d.utility.Vector2iVector(np.column_stack([rows, rows]))
    result = registration.registration_ransac_based_on_correspondence(
        cloud(source), cloud(target), pairs,
        max_correspondence_distance=0.2, ransac_n=3,
        criteria=registration.RANSACConvergenceCriteria(1000, 0.99),
    )
    return result.transformation
