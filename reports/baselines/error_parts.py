"""Where depth errors lie: at the silhouette, at depth steps, inside, and by how slowly coverage builds up; and the 2-D
orientation's error by the strength of its filter.

usage: python error_parts.py SCENE_FOLDER... [--variant luo] [--sheet sheet.jpg]

Takes folders as `strandbench run` writes them (render/ and VARIANT/score/ inside) and prints, for each part of the
eroded mask, its share of the pixels, the median error, its bias, the spread about the bias, and its share of the
errors beyond 10 mm. `--sheet` draws the reference image beside the error map of every scene: blue is towards the
camera, red is away from it, full colour at 10 mm.
"""
import argparse
import pathlib

import cv2
import numpy as np
import OpenEXR

RIM_PX = 16  # from the mask's edge: 12 mm
STEP_MM = 20  # range of the depth within 9x9 pixels
BUILD_UP_MM = (0, 1, 3, 6, 12, np.inf)
FULL_COLOUR_MM = 10


def planes(path):
    return {name: channel.pixels for name, channel in OpenEXR.File(str(path)).channels().items()}


def row(name, part, error, bad):
    e = error[part]
    if e.size == 0:
        return
    bias = np.median(e)
    print(f"  {name:22} {100 * e.size / np.isfinite(error).sum():5.1f} % of pixels, median {np.median(abs(e)):5.2f} mm, "
          f"bias {bias:+6.2f}, about it {np.median(abs(e - bias)):5.2f}; beyond 10 mm {100 * (abs(e) > 10).mean():4.1f} %: "
          f"{100 * (part & (error < -10)).sum() / bad:3.0f} % of all such towards, "
          f"{100 * (part & (error > 10)).sum() / bad:3.0f} % away")


def parts(folder, variant):
    truth = planes(folder / "render/truth/center_truth.exr")
    error = next(iter(planes(folder / variant / "score/errors.exr").values())).astype(float)
    hair = (truth["coverage"] > 0.5).astype(np.uint8)
    half, first = truth["depth_50_mm"].astype(float), truth["depth_first_mm"].astype(float)
    error[(cv2.erode(hair, np.ones((5, 5))) == 0) | ~(half > 0)] = np.nan
    judged = np.isfinite(error)
    smooth = cv2.medianBlur(np.where(half > 0, half, 0).astype(np.float32), 5)
    window = np.ones((9, 9))
    span = cv2.dilate(np.where(judged, smooth, -1e9), window) - cv2.erode(np.where(judged, smooth, 1e9), window)
    rim = judged & (cv2.distanceTransform(hair, cv2.DIST_L2, 5) < RIM_PX)
    step = judged & ~rim & (span > STEP_MM)
    inside = judged & ~rim & ~step
    bad = max((abs(error[judged]) > 10).sum(), 1)
    print(folder.name)
    for name, part in (("all", judged), ("silhouette", rim), ("depth steps", step), ("inside", inside)):
        row(name, part, error, bad)
    for low, high in zip(BUILD_UP_MM, BUILD_UP_MM[1:]):
        build_up = half - first
        row(f"inside, {low} to {high} mm", inside & (build_up >= low) & (build_up < high), error, bad)


def orientation(folder, variant):
    truth = planes(folder / "render/truth/center_truth.exr")
    field = planes(folder / variant / "reconstruct/estimate/orientation.exr")
    strength, angle = np.hypot(field["re"], field["im"]), 0.5 * np.arctan2(field["im"], field["re"])
    answered = (truth["mask"] > 0.5) & (strength > 0) & np.isfinite(truth["orientation_2d_rad"])
    between = (angle - truth["orientation_2d_rad"] + np.pi / 2) % np.pi - np.pi / 2
    error, strength = abs(np.degrees(between[answered])), strength[answered]
    for share in (100, 50, 25, 10):
        strong = error[strength >= np.percentile(strength, 100 - share)]
        print(f"  orientation, strongest {share:3} %: median {np.median(strong):4.1f} degrees, "
              f"within 20 degrees {100 * (strong < 20).mean():.0f} %")


def picture(folder, variant):
    error = next(iter(planes(folder / variant / "score/errors.exr").values()))
    t = np.clip(error / FULL_COLOUR_MM, -1, 1)[..., None]
    colour = np.where(t < 0, [1, 0, 0] * -t + 1 + t, [0, 0, 1] * t + 1 - t)
    colour = np.nan_to_num(255 * colour).astype(np.uint8)
    image = cv2.imread(str(folder / "render/center.png"))
    both = cv2.resize(np.hstack([image, colour]), None, fx=0.5, fy=0.5, interpolation=cv2.INTER_AREA)
    cv2.putText(both, folder.name, (6, 14), cv2.FONT_HERSHEY_SIMPLEX, 0.45, (255, 255, 255), 1, cv2.LINE_AA)
    return both


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folders", nargs="+", type=pathlib.Path)
    parser.add_argument("--variant", default="luo")
    parser.add_argument("--sheet", type=pathlib.Path)
    args = parser.parse_args()
    for folder in args.folders:
        parts(folder, args.variant)
        orientation(folder, args.variant)
    if args.sheet:
        pictures = [picture(folder, args.variant) for folder in args.folders]
        if len(pictures) % 2:
            pictures.append(np.zeros_like(pictures[0]))
        rows = [np.hstack(pictures[i:i + 2]) for i in range(0, len(pictures), 2)]
        cv2.imwrite(str(args.sheet), np.vstack(rows), [cv2.IMWRITE_JPEG_QUALITY, 82])


if __name__ == "__main__":
    main()
