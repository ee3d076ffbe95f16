import open3d as o3d

registration = o3d.pipelines.registration


def cloud(points):
    return o3d.geometry.PointCloud(o3d.utility.Vector3dVector(points))


def register(source, target, start):
    result = registration.registration_icp(
        cloud(source), cloud(target), 2.6, start,
        registration.TransformationEstimationPointToPoint(),
        registration.ICPConvergenceCriteria(0.0, 0.0, 20),
    )
    return result.transformation
