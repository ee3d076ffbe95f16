from skimage.transform import EuclideanTransform


def register(source, target):
    return EuclideanTransform.from_estimate(source, target).params
