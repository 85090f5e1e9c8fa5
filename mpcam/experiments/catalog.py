"""The experiments by name: where each is, and what it measures."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Experiment:
    """An experiment's name, the module of this package that has its `run`, and what it measures, in one line."""

    name: str
    module: str
    summary: str


EXPERIMENTS = {
    experiment.name: experiment
    for experiment in (
        Experiment(
            "gascuel2008-table2",
            "gascuel2008_table2",
            "Gascuel et al. 2008, Table 2: cube and hemicube against one or two non-linear projections",
        ),
        Experiment(
            "gascuel2008-table3",
            "gascuel2008_table3",
            "Gascuel et al. 2008, Table 3: overdraw and the cost of each step, by projection and bound",
        ),
        Experiment(
            "gascuel2008-fig9",
            "gascuel2008_fig9",
            "Gascuel et al. 2008, Fig. 9: the pixels that each bound tests, as pictures",
        ),
        Experiment(
            "gascuel2008-growth",
            "gascuel2008_growth",
            "Time and peak memory against the number of triangles and of pixels, next to ray tracing",
        ),
        Experiment(
            "hou2006-table1",
            "hou2006_table1",
            "Hou et al. 2006, Table 1: overdraw of camera triangles by bound; frames against rebuilding and tracing",
        ),
        Experiment(
            "hou2006-fig6",
            "hou2006_fig6",
            "Hou et al. 2006, Figs. 1 and 6: quality against tessellation, environment maps and ray tracing beside",
        ),
        Experiment(
            "hou2006-fig7",
            "hou2006_fig7",
            "Hou et al. 2006, Fig. 7: many moving objects around a teapot, with and without each acceleration",
        ),
        Experiment(
            "yu2009-fig1",
            "yu2009_fig1",
            "Yu et al. 2009, Fig. 1: a cross-slit strip along a moving city, against rebuilding a tree and tracing",
        ),
        Experiment(
            "yu2009-fig5",
            "yu2009_fig5",
            "Yu et al. 2009, Fig. 5: a cross-slit camera by two passes of several patches, and by ray tracing",
        ),
        Experiment(
            "yu2009-fig6-fig7",
            "yu2009_fig6_fig7",
            "Yu et al. 2009, Figs. 6 and 7: panoramas of things from all sides, by number of pieces; a top view",
        ),
        Experiment(
            "yu2009-fig8",
            "yu2009_fig8",
            "Yu et al. 2009, Fig. 8: a mirror sphere of general linear cameras among butterflies; errors and seams",
        ),
        Experiment(
            "yu2009-fig9",
            "yu2009_fig9",
            "Yu et al. 2009, Fig. 9: a still animal turns its head, by two cross-slit cameras on a hinge",
        ),
        Experiment(
            "yu2009-fig10",
            "yu2009_fig10",
            "Yu et al. 2009, Fig. 10: mirrors by numbers of cameras and scene triangles; the cost of one more camera",
        ),
        Experiment(
            "rosen2011-relief",
            "rosen2011_relief",
            "Rosen et al. 2011, Figs. 2, 12, 13 and 20: cars and barrels as relief textures, against their triangles",
        ),
        Experiment(
            "leaving-out",
            "leaving_out",
            "What each part of the rasterizer is worth: frames without it, and the inner loop against its limit",
        ),
        Experiment(
            "moving-scene",
            "moving_scene",
            "Rasterizing against rebuilding a tree and tracing, for moving and still scenes",
        ),
        Experiment(
            "rosen2011-fig1",
            "rosen2011_fig1",
            "Rosen et al. 2011, Figs. 1, 11, 15: what depth images lack in a mirror, by camera; errors and times",
        ),
        Experiment(
            "fit-error-vs-triangles",
            "fit_error_vs_triangles",
            "Rays of uniform, simplified and fitted camera triangles, 16 to 2,048 of them, on eight reflectors",
        ),
        Experiment(
            "fit-hou2006-fig6",
            "fit_hou2006_fig6",
            "The mirrors of Hou et al. 2006, Fig. 6, by fitted camera triangles: pictures as good with how many fewer",
        ),
        Experiment(
            "rosen2011-fig17-fig19",
            "rosen2011_fig17_fig19",
            "Rosen et al. 2011, Figs. 17 and 19: steps of rays over depth images, with and without coarse steps",
        ),
        Experiment(
            "rosen2011-ambient-occlusion",
            "rosen2011_ambient_occlusion",
            "Rosen et al. 2011, Fig. 3: ambient occlusion by the output's z-buffer and by ones that see more",
        ),
        Experiment(
            "rosen2011-table1",
            "rosen2011_table1",
            "Rosen et al. 2011, Table 1: time of a reflection by output, fine step, depth image, coarse step; memory",
        ),
    )
}
