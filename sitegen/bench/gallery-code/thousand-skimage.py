from skimage.transform import EuclideanTransform


def register(source, targets):
    return [EuclideanTransform.from_estimate(source, target).params for target in targets]
