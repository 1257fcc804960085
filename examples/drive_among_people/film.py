"""A drive to look at: what the camera saw, and the plan below it."""
import numpy as np
from PIL import Image, ImageDraw

from planner import FREE, OCCUPIED
from rendered import HEIGHT, WIDTH

LOW, HIGH, SCALE = np.array([-4.7, -4.3]), np.array([4.7, 2.2]), 34  # of the room [m], pixels a metre
SIZE = tuple(int(x) for x in (HIGH - LOW) * SCALE)
TITLE = 16  # pixels
COLOURS = {FREE: (255, 255, 255), OCCUPIED: (0, 0, 0)}


def at(p):
    return (p[0] - LOW[0]) * SCALE, SIZE[1] - (p[1] - LOW[1]) * SCALE


def disc(draw, p, radius_m, **how):
    x, y = at(p)
    r = radius_m * SCALE
    draw.ellipse([x - r, y - r, x + r, y + r], **how)


def plan_picture(grid, path, forecasts, here, goal, people):
    """Unknown grey, free white, what stands black; people blue, forecasts of 1 s as red rings of a sigma, robot green."""
    image = Image.new("RGB", SIZE, (170, 170, 170))
    draw = ImageDraw.Draw(image)
    half = grid.cell_m / 2
    for what, colour in COLOURS.items():
        for p in grid.middles()[grid.cells == what]:
            (left, bottom), (right, top) = at(p - half), at(p + half)
            draw.rectangle([left, top, right, bottom], fill=colour)
    for p in people:
        disc(draw, p, 0.2, fill=(110, 150, 240))
    for forecast in forecasts:
        _, place, sigma_m = forecast[2]
        disc(draw, place, max(0.1, sigma_m), outline=(220, 0, 0), width=2)
    if len(path) > 1:
        draw.line([at(p) for p in path], fill=(20, 140, 60), width=2)
    disc(draw, here, 0.25, fill=(20, 140, 60))
    disc(draw, goal, 0.15, outline=(20, 140, 60), width=3)
    return image


def frame_of(shot, title):
    rgb, *seen = shot
    picture = Image.new("RGB", (SIZE[0], TITLE + HEIGHT + SIZE[1]), "white")
    picture.paste(Image.fromarray(rgb), ((SIZE[0] - WIDTH) // 2, TITLE))
    picture.paste(plan_picture(*seen), (0, TITLE + HEIGHT))
    ImageDraw.Draw(picture).text((4, 2), title, fill="black")
    return picture


def film(drives, file, step_s):
    """Side by side, the one that is there first waits. @param drives title -> shots, `step_s` apart."""
    columns = [[frame_of(shot, title) for shot in shots] for title, shots in drives.items()]
    frames = []
    for i in range(max(map(len, columns))):
        frame = Image.new("RGB", (SIZE[0] * len(columns) + 8 * (len(columns) - 1), TITLE + HEIGHT + SIZE[1]), "white")
        for k, column in enumerate(columns):
            frame.paste(column[min(i, len(column) - 1)], (k * (SIZE[0] + 8), 0))
        frames.append(frame)
    frames[0].save(file, save_all=True, append_images=frames[1:], duration=round(1000 * step_s), quality=70)


def strip(shots, fps):
    """What led to a contact, as plans in two rows. @param shots of each the frame's number, then as for plan_picture."""
    across = max(1, (len(shots) + 1) // 2)
    picture = Image.new("RGB", (across * (SIZE[0] + 4), 2 * (SIZE[1] + TITLE)), "white")
    for i, (k, *seen) in enumerate(shots):
        corner = (i % across * (SIZE[0] + 4), i // across * (SIZE[1] + TITLE))
        picture.paste(plan_picture(*seen), (corner[0], corner[1] + TITLE))
        ImageDraw.Draw(picture).text((corner[0] + 4, corner[1] + 2), f"{k / fps:.1f} s", fill="black")
    return picture


def picture(truth, track, goals, contacts, title, scale=90):
    """From above: furniture grey, people's ways blue, the drive green, goals numbered, contacts red (driven) and orange."""
    size = tuple(int(x) for x in (HIGH - LOW) * scale)
    image = Image.new("RGB", size, "white")
    draw = ImageDraw.Draw(image)

    def at(p):
        return (p[0] - LOW[0]) * scale, size[1] - (p[1] - LOW[1]) * scale
    for p in truth.furniture:
        x, y = at(p)
        draw.rectangle([x - 2, y - 2, x + 2, y + 2], fill=(150, 150, 150))
    for person in range(truth.people.shape[1]):
        draw.line([at(p) for p in truth.people[:len(track), person]], fill=(150, 180, 240), width=2)
    draw.line([at(p) for p in track], fill=(20, 140, 60), width=4)
    for i, goal in enumerate(goals):
        x, y = at(goal)
        draw.ellipse([x - 11, y - 11, x + 11, y + 11], outline="black", fill="white")
        draw.text((x - 5, y - 6), "S" if i == 0 else str(i), fill="black")
    for place, kind, t_s, _ in contacts:
        x, y = at(place)
        draw.ellipse([x - 12, y - 12, x + 12, y + 12], outline=(220, 0, 0) if kind == "driven_into" else (230, 150, 0), width=4)
        draw.text((x + 14, y - 5), f"{t_s}", fill="black")
    draw.text((8, 6), title, fill="black")
    return image
