import open3d as o3d

registration = o3d.pipelines.registration


def register(source, target, start):
    moving, fixed = (o3d.geometry.PointCloud(o3d.utility.Vector3dVector(cloud)) for cloud in (source, target))
    return registration.registration_icp(
        moving, fixed, 2.6, start, registration.TransformationEstimationPointToPoint(),
        registration.ICPConvergenceCriteria(relative_fitness=0.0, relative_rmse=0.0, max_iteration=20),
    ).transformation
