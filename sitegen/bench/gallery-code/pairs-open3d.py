import numpy as np
import open3d as o3d

registration = o3d.pipelines.registration


def cloud(points):
    return o3d.geometry.PointCloud(o3d.utility.Vector3dVector(points))


def register(source, target):
    rows = np.arange(len(source))
    pairs = o3d.utility.Vector2iVector(np.column_stack([rows, rows]))
    fit = registration.TransformationEstimationPointToPoint()
    return fit.compute_transformation(cloud(source), cloud(target), pairs)
