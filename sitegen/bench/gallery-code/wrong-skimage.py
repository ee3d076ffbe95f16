from skimage.measure import ransac
from skimage.transform import EuclideanTransform


def register(source, target):
    model, _ = ransac(
        (source, target), EuclideanTransform,
        min_samples=2, residual_threshold=0.2,
        stop_probability=0.99, max_trials=1000, rng=0,
    )
    return model.params
