"""Radau IIA coefficients for 3, 5 and 7 stages, rounded from 60 digits.

The nodes c are the zeros of P_{s-1} - P_s shifted to (0, 1]; A is the collocation matrix; A^-1 = T diag(lambda) T^-1
is kept as one real eigenvector and (s-1)/2 complex pairs, of which only the member with positive imaginary part is
stored (PAIR_COLUMNS carries the factor 2 of its conjugate). Tables are padded to seven stages; the first index is the
family member k = (s - 3) / 2.

Source: Hairer & Wanner, Solving Ordinary Differential Equations II, sections IV.5 and IV.8.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

STAGES = (3, 5, 7)

EDGE = 1e-6
"""The slopes of margins at both ends of a step are seen at this distance."""
SCAN_POINTS = 17
"""Points of a step of the highest order at which margins are examined."""


def _padded(shape: tuple[int, ...], *members: tuple[Any, ...]) -> NDArray[Any]:
    """Stack the three tables, each s by s, s by p, ... in its own size, into one zero-padded array."""
    table: NDArray[Any] = np.zeros((3, *shape), dtype=np.asarray(members[0]).dtype)
    for k, member in enumerate(members):
        s = STAGES[k]
        size = tuple(s if axis == 7 else (s - 1) // 2 for axis in shape)
        table[k][tuple(slice(count) for count in size)] = np.reshape(member, size)
    return table


# fmt: off
GAMMA = np.array([3.637834252744496, 6.2867047517292765, 8.936832788405216])
"""The real eigenvalue of A^-1."""

NODES = _padded(
    (7,),
    (
        0.1550510257216822, 0.6449489742783178, 1.0,
    ),
    (
        0.05710419611451768, 0.2768430136381238, 0.5835904323689168, 0.8602401356562195, 1.0,
    ),
    (
        0.029316427159784893, 0.1480785996684843, 0.3369846902811543, 0.5586715187715501, 0.7692338620300545,
        0.9269456713197411, 1.0,
    ),
)

COLLOCATION = _padded(
    (7, 7),
    (
        0.1968154772236604, -0.06553542585019839, 0.02377097434822015, 0.3944243147390873, 0.2920734116652285,
        -0.04154875212599793, 0.37640306270046725, 0.5124858261884216, 0.1111111111111111,
    ),
    (
        0.07299886431790333, -0.02673533110794557, 0.018676929763984353, -0.01287910609330644,
        0.005042839233882015, 0.15377523147918246, 0.14621486784749352, -0.03644456890512809,
        0.02123306311930472, -0.007935579902728777, 0.14006304568480987, 0.29896712949128346,
        0.16758507013524895, -0.03396910168661774, 0.010944288744192253, 0.14489430810953477,
        0.2765000687601592, 0.32579792291042103, 0.12875675325490976, -0.015708917378805327,
        0.14371356079122594, 0.28135601514946207, 0.31182652297574126, 0.22310390108357075, 0.04,
    ),
    (
        0.03754626499392133, -0.0140393345564604, 0.0103527896007423, -0.008158322540275011,
        0.006388413879534685, -0.004602326779148656, 0.0018289425614706437, 0.08014759651561897,
        0.08106206398589154, -0.021237992120711036, 0.014000291238817119, -0.010234185730090163,
        0.0071534651513645905, -0.0028126393724067235, 0.0720638469418819, 0.17106835498388662,
        0.10961456404007211, -0.024619871728984055, 0.014760377043950817, -0.009575259396791401,
        0.0036726783971383057, 0.07570512581982441, 0.15409015514217114, 0.2271077366732024,
        0.11747818703702478, -0.023810827153044174, 0.012709985533661206, -0.004608844281289633,
        0.07391234216319184, 0.16135560761594242, 0.2068672415521042, 0.23700711534269422, 0.10308679353381345,
        -0.018854139152580447, 0.0058589009748887914, 0.07470556205979623, 0.1583072238724687,
        0.21415342326720002, 0.21987784703186003, 0.19875212168063527, 0.06926550160550914,
        -0.00811600819772829, 0.07449423555601031, 0.15910211573365074, 0.21235188950297781,
        0.22355491450728324, 0.19047493682211558, 0.1196137446126562, 0.02040816326530612,
    ),
)

INVERSE = _padded(
    (7, 7),
    (
        3.224744871391589, 1.1678400846904056, -0.25319726474218085, -3.5678400846904057, 0.775255128608411,
        1.0531972647421808, 5.531972647421808, -7.531972647421808, 5.0,
    ),
    (
        8.755923977938362, 2.8919426153801173, -0.8751863962002651, 0.3997052079399655, -0.13370616384921583,
        -7.161380720145387, 1.8060777240836443, 2.3637971760686085, -0.8659007802831346, 0.2743380777751942,
        4.122165246243374, -4.4960171258133945, 0.8567652453971776, 2.5183209492110645, -0.6570627571343601,
        -3.8786632197240105, 3.3931519180649543, -5.188340906407187, 0.5812330525808164, 2.809983655279712,
        8.41242422359429, -6.970256116656661, 8.777114204150473, -18.2192823110881, 13.0,
    ),
    (
        17.055284304421654, 5.475299512185492, -1.618581105190787, 0.7496541282385066, -0.421891375983016,
        0.25105021424639273, -0.09232481935368413, -12.948988698811522, 3.376585145452422, 4.054013503925586,
        -1.4863139760065447, 0.7728544737788972, -0.44494694720107, 0.1617747003353814, 6.526797433701593,
        -6.912304925481829, 1.4837469310040114, 3.5946033544558915, -1.4502156012225291, 0.7670384491813573,
        -0.27142848561987243, -4.760415643167771, 3.990860318095922, -5.660688333657835, 0.8949802937859413,
        3.735899391500152, -1.5419785025493504, 0.5117126570997156, 4.329451016638691, -3.3535280016779185,
        3.6906179318627217, -6.037309187265788, 0.6499973865951115, 4.577300941414561, -1.2440566466772534,
        -4.943623833507561, 3.704802676027051, -3.7457284313738155, 4.7816656257626144, -8.783388755925044,
        0.5394059387408583, 5.443680188059144, 11.495455205116665, -8.517072423056625, 8.381031301964825,
        -10.033441651950401, 15.094393942991166, -34.42036637506563, 25.0,
    ),
)

REAL_ROW = _padded(
    (7,),
    (
        4.178718591551905, 0.32768282076106237, 0.5233764454994495,
    ),
    (
        27.697693775684087, 12.783337911304406, 3.20848938671343, -0.9514904122489162, 0.7415504960259897,
    ),
    (
        227.51530596268069, 166.64802246760974, 43.26514588452621, 3.623090061341016, 3.572674832938798,
        -2.7435563656033675, 1.4514535402547504,
    ),
)

REAL_COLUMN = _padded(
    (7,),
    (
        0.09443876248897524, 0.2502131229653333, 1.0,
    ),
    (
        0.013576867344947943, 0.0016179004017190875, 0.07915785334744721, 0.41225608268046143, 1.0,
    ),
    (
        0.0024435843048706113, -0.001815339648319317, 0.004605339331161875, 0.017870023342853068,
        0.12818100807728391, 0.5200651497488247, 1.0,
    ),
)

PAIR_VALUES = _padded(
    (3,),
    (
        2.6810828736277523+3.0504301992474105j,
    ),
    (
        5.70095329867179+3.2102656003085497j, 3.655694325463572+6.543736899360077j,
    ),
    (
        8.511834825102946+3.281013624325059j, 7.14105521918764+6.623045922639276j,
        4.378693561506806+10.169693283795011j,
    ),
)

PAIR_ROWS = _padded(
    (3, 7),
    (
        -2.0893592957759526-0.2514363174728934j, -0.16384141038053118+1.2859634749278026j,
        0.23831177725027522-0.29801960241411246j,
    ),
    (
        -16.5209401067595-4.305721989937646j, -8.688476739531783+4.849995704764404j,
        -0.08606453162700278+0.9573643198484372j, -0.04958488899127132+1.20934600304247j,
        0.2656140579191533-0.5237317439676688j, 2.672093218917456+1.8740299037199024j,
        2.2968077838795806-1.9924828681719424j, -1.5181801617297122-0.5222078208040094j,
        0.5253300951157295+0.5920492840689743j, -0.13638930593214812-0.22495888507839018j,
    ),
    (
        -149.59312401412606-46.53825144871765j, -121.52037268437239+11.940815528140572j,
        -24.388552039018936+19.639440365406923j, -1.0193359528709671+7.19445784274554j,
        0.8367801199305425-1.7552191996996807j, -0.5436870160285531+2.4316424427830903j,
        0.45096912464804967-1.1232413647956199j, 37.33916611751135+29.178264425953287j,
        43.704294489950406-5.03438697890009j, 2.012079368689999-15.183194421283336j,
        -1.857403157579182-0.510010432592433j, -1.7150469929911587-0.05620875018921248j,
        1.3483024048826562+0.9453204155001889j, -0.4693463718037731-0.48582431969157414j,
        -1.503695084725646-4.220981594160542j, -5.507933039382886-0.3252626370287575j,
        0.7438997280658282+3.4703353651849382j, 1.0651940797796413-1.6025237627989493j,
        -0.9080705434087828+0.5356404717732393j, 0.5671627939475805-0.1774253745608111j,
        -0.20734952297165177+0.04599274566393277j,
    ),
)

PAIR_COLUMNS = _padded(
    (7, 3),
    (
        -0.2825105900419084+0.06005838821029485j, 0.4082587045875999-0.7658842255145238j, 2+0j,
    ),
    (
        -0.02295703051045903+0.02803971778575082j, -0.020484095635817653-0.09534775458059144j,
        -0.015337661498360326-0.049417156853037054j, 0.10034572903474212+0.18866363836322286j,
        0.0387969279976579-0.16360070740750235j, -0.4610790680868359-0.2054060907602518j,
        0.8152023425603981-0.39936485577360503j, 0.7557878044977225-0.9334882606649887j, 2+0j, 2+0j,
    ),
    (
        -0.0024772923759057482+0.005521234961087705j, -0.008110322904662048-0.00885446550653657j,
        0.043135102702641544-0.01756713585028829j, -0.00013333270678792677-0.00637094965033242j,
        0.01683113655311918+0.0080638991404491j, -0.0762632962688231+0.04305112118801375j,
        -0.004704361965886677-0.0008338155450595125j, -0.017120862123206865+0.013846425330047818j,
        0.11479301787876343-0.11770105841685358j, 0.0062301423046923505-0.050233209826877644j,
        -0.07474248460476891-0.01647801459701544j, -0.0764293871939367+0.3314736225458877j,
        0.2034354649634303-0.19009004071209246j, 0.010733522758363541-0.38642223220252403j,
        -0.4983484249305274-0.5471266115973247j, 1.0435038905495306-0.2561438892710878j,
        1.0531484529168986-0.5510687899792517j, 1.063169298167257-0.9726456732351458j, 2+0j, 2+0j, 2+0j,
    ),
)


# fmt: on


def _lagrange(nodes: NDArray[np.float64]) -> NDArray[np.float64]:
    """1 / (c_j prod_{k != j} (c_j - c_k)): barycentric weights of the nodes 0, c_1, ..., c_s without the node 0."""
    gaps = nodes[:, None] - nodes[None, :] + np.eye(len(nodes))
    return np.asarray(1.0 / (nodes * gaps.prod(axis=1)))


def _defect(nodes: NDArray[np.float64]) -> NDArray[np.float64]:
    """Coefficients of x, x^2, ... in the integral from 0 to x of prod_i (1 - x / c_i)."""
    product = np.poly1d([1.0])
    for node in nodes:
        product *= np.poly1d([-1.0 / node, 1.0])
    return np.asarray(product.integ().coeffs[::-1][1:])


def _probe(nodes: NDArray[np.float64]) -> np.float64:
    """Where the interpolation error x prod_i (x - c_i) is largest."""
    x = np.linspace(0.0, 1.0, 1001)
    return np.float64(x[np.argmax(np.abs(x * np.prod(x[:, None] - nodes, axis=1)))])


def _probe_rate(nodes: NDArray[np.float64], x: float) -> NDArray[np.float64]:
    """Values at x of the Lagrange polynomials on c_1, ..., c_s and, last of eight, on 0."""
    points = np.append(nodes, 0.0)
    values = [np.prod((x - np.delete(points, i)) / (c - np.delete(points, i))) for i, c in enumerate(points)]
    return np.concatenate([values[:-1], np.zeros(8 - len(points)), values[-1:]])


def _newton(nodes: NDArray[np.float64], coefficients: NDArray[np.float64]) -> NDArray[np.float64]:
    """The polynomial of these coefficients of x, x^2, ... in Newton's form x, x (x - c_1), x (x - c_1)(x - c_2), ...;
    the last of ten factors is x again.
    """
    rest, result = np.poly1d(coefficients[::-1]), np.zeros(9)
    for i, node in enumerate(np.append(nodes, 0.0)):
        rest, remainder = np.polydiv(rest, np.poly1d([1.0, -node]))
        result[i] = remainder[-1] if isinstance(remainder, np.ndarray) else remainder(0.0)
    result[len(nodes) + 1] = np.poly1d(rest)(0.0)
    return result


def _probe_shape(nodes: NDArray[np.float64], x: float) -> NDArray[np.float64]:
    """Coefficients of x, x^2, ... in the integral from 0 of x prod_i (x - c_i), which is one at the probe."""
    product = np.poly1d(np.append(nodes, 0.0), r=True)
    return np.asarray((product / product(x)).integ().coeffs[::-1][1:])


def _scanned(k: int) -> NDArray[np.float64]:
    """Fractions of the step, from its start, just inside its end, to its end; more points for higher orders."""
    last = 4 * k + 7
    inside = [EDGE, *(np.arange(1, last) / last), 1.0 - EDGE, 1.0]
    return np.pad(inside, (0, SCAN_POINTS - len(inside)), constant_values=1.0)


def _scan_table(nodes: NDArray[np.float64], points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Value and rate at the points of the polynomial through (0, 0), (c_j, z_j) per unit z_j, and, behind these, of
    the shape of its error.
    """
    table = np.zeros((2, SCAN_POINTS, 8))
    for j, c in enumerate(nodes):
        others = np.append(np.delete(nodes, j), 0.0)
        # As products: sums of powers would lose digits, and the end of the step is a node.
        parts = (points[:, None] - others) / (c - others)
        table[0, :, j] = parts.prod(axis=1)
        for i, other in enumerate(others):
            table[1, :, j] += np.delete(parts, i, axis=1).prod(axis=1) / (c - other)
    table[0, :, len(nodes)] = np.polyval(np.append(_defect(nodes)[::-1], 0.0), points)
    table[1, :, len(nodes)] = (1.0 - points[:, None] / nodes).prod(axis=1)
    return table


def _inverse_gaps(nodes: NDArray[np.float64]) -> NDArray[np.float64]:
    """1 / (c_i - c_{i-level}) for divided differences of each level; level 0 divides by c_i."""
    table = np.zeros((7, 7))
    for level in range(len(nodes)):
        for i in range(level, len(nodes)):
            table[level, i] = 1.0 / (nodes[i] - (nodes[i - level] if level else 0.0))
    return table


def _real_rows() -> NDArray[np.float64]:
    """T^-1 and T as real tables: a row, or a column, of the real eigenvector, then two of each pair."""
    rows, columns = np.zeros((3, 7, 7)), np.zeros((3, 7, 7))
    rows[:, 0], rows[:, 1::2], rows[:, 2::2] = REAL_ROW, PAIR_ROWS.real, PAIR_ROWS.imag
    columns[:, :, 0], columns[:, :, 1::2], columns[:, :, 2::2] = REAL_COLUMN, PAIR_COLUMNS.real, -PAIR_COLUMNS.imag
    return np.stack([-rows, columns])


TO_PARTS, FROM_PARTS = _real_rows()
"""From residuals to the right-hand sides of the decoupled systems, and from their solutions to the stages."""
_members = [NODES[k, :s] for k, s in enumerate(STAGES)]
START_RATE = np.array([np.pad(-_lagrange(c) * np.prod(-c), (0, 7 - len(c))) for c in _members])
"""Value at 0 of the Lagrange polynomials on c_1, ..., c_s: extrapolates stage rates to the start of the step."""
START_SLOPE = np.array([np.pad(-_lagrange(c) * np.prod(-c) / c, (0, 7 - len(c))) for c in _members])
"""Derivative at 0 of the polynomial through (0, 0), (c_j, z_j): its difference to the true rate is the error
estimate."""
INVERSE_GAPS = np.array([_inverse_gaps(c) for c in _members])
NEWTON_NODES = np.array([np.pad(c, (0, 9 - len(c))) for c in _members])
DEFECT = np.array([_newton(c, _defect(c)) for c in _members])
"""Shape of the error of the collocation polynomial, per unit defect of its derivative at 0, in Newton's form."""
PROBE = np.array([_probe(c) for c in _members])
"""Fraction of the step at which a component that the stages only interpolate is worst."""
PROBE_RATE = np.array([_probe_rate(c, x) for c, x in zip(_members, PROBE, strict=True)])
"""Extrapolates the rates of the stages and of the start (last) to the probe."""
PROBE_SHAPE = np.array([_newton(c, _probe_shape(c, x)) for c, x in zip(_members, PROBE, strict=True)])
"""Shape of a quadrature's error, per unit defect of its rate at the probe, in Newton's form."""
SCANNED = np.array([_scanned(k) for k in range(len(STAGES))])
"""Points of a step at which margins are examined."""
_scans = np.array([_scan_table(c, x) for c, x in zip(_members, SCANNED, strict=True)])
SCAN_VALUES, SCAN_RATES = np.ascontiguousarray(_scans[:, 0]), np.ascontiguousarray(_scans[:, 1])
"""State and rate at these points from the stages and, behind them, the correction of the polynomial."""
