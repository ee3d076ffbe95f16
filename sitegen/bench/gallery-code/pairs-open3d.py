import numpy as np
import open3d as o3d

registration = o3d.pipelines.registration


def register(source, target):
    moving, fixed = (o3d.geometry.PointCloud(o3d.utility.Vector3dVector(cloud)) for cloud in (source, target))
    pairs = o3d.utility.Vector2iVector(np.repeat(np.arange(len(source))[:, None], 2, axis=1))
    return registration.TransformationEstimationPointToPoint().compute_transformation(moving, fixed, pairs)
