"""Where the real recordings come from: repository, commit, path and checksum of each file."""

from __future__ import annotations

from dataclasses import dataclass
from urllib.parse import quote

from pikanid import errors


@dataclass(frozen=True)
class Origin:
    """One file of a public repository.

    Attributes:
        repository: ``owner/name`` on GitHub.
        commit: Of the repository.
        path: In the repository.
        local: Path in a folder of recordings.
        sha256: Of the file as it is in the repository.
    """

    repository: str
    commit: str
    path: str
    local: str
    sha256: str

    @property
    def name(self) -> str:
        """Name of the file."""
        return self.local.rsplit("/", 1)[-1]

    @property
    def url(self) -> str:
        """Address of the raw file.

        >>> SILVERBOX.url.endswith("/data/Silverbox/SNLS80mV.mat")
        True
        """
        return (
            f"https://raw.githubusercontent.com/{self.repository}/{self.commit}/{quote(self.path)}"
        )


SINGLE_PENDULUM = Origin(
    "dynamicslab/MultiArm-Pendulum", "e99a7e13fe2adc8fc647321a156b6cb59a48a698",
    "ParameterEstimation/SinglePendulum/SinglePendulumDataForParameterEstimation.mat",
    "single_pendulum_uw/SinglePendulumDataForParameterEstimation.mat",
    "f3b8cdda4a6e86405ec37ff32b98be76fd37806a609cba7870628c1e40377a98")
FREE_SWING = Origin(SINGLE_PENDULUM.repository, SINGLE_PENDULUM.commit,
                    "Datas/SinglePendulum/SingleDataFreeSwing_1_Dt_0_0001.mat",
                    "single_pendulum_uw/SingleDataFreeSwing_1_Dt_0_0001.mat",
                    "5e6272350a91fb9fb99b6949bc49e3e63e21af977cc1f777310f5d8e9b0fc7e7")
SILVERBOX = Origin("biaslab/nsi-silverbox", "728f07e4539d4f7da76a4778b52a756260b488ac",
                   "data/Silverbox/SNLS80mV.mat", "silverbox/SNLS80mV.mat",
                   "5c7413a52255af0cb4e2f93fb6903beb92b08965ba1e6ad0a6ffedfed8477ed4")
CASCADED_TANKS = Origin("forgi86/sysid-neural-continuous",
                        "956aa7ecd73061b0321c6f6098d74c9e4a7ce67a",
                        "examples/CTS/data/dataBenchmark.csv", "cascaded_tanks/dataBenchmark.csv",
                        "ef2388ed822f3aef4aa80d6b0f2b466dd80b361786b3eafc7a2957c31ea323a7")
_RUNS = {
    "train": ("143601", "e028c1d7a6a45cfe1b96b7cb33aae412b8888f022677d392f6f9cd4d4f63886d"),
    "held_out": ("143524", "03fc5e18915e80afabb3e2674b627f9d849d43675aeacbf586ccd24b3ebd7ca5"),
    "held_out_2": ("143339", "94f17287b53187dfe8f4ce131f4e7c49918309fcc915cbae2f64ed3101e7c23b")}
DOUBLE_PENDULUM = {part: Origin(
    "dfki-ric-underactuated-lab/double_pendulum", "1e8544e67f3da72a51ee52fbbb278e131ce2a43f",
    f"data/experiment_records/design_C.1/sys_id/20230629/{run}/trajectory.csv",
    f"double_pendulum/20230629-{run}/trajectory.csv", sha256)
    for part, (run, sha256) in _RUNS.items()}
BUILDING = Origin("JulienLeprince/fiftyshadesofgrey", "0e670018c93aeccc973ca38701c96d204818b352",
                  "data/in/blg_3.csv", "buildings/blg_3.csv",
                  "c423c64051869280621880e4ceabc8dcc48cbf683e9c0512654a82ac03a6769b")
THEOPHYLLINE = Origin("vincentarelbundock/Rdatasets", "1dcc2bf5f955cc1224a3e1307256e1fe86b68dae",
                      "csv/datasets/Theoph.csv", "theophylline/Theoph.csv",
                      "f9b77033090644cf38c83056c25c8137bca71cf629d7c0159a72ef18095726b0")
LYNX_HARE = Origin("stan-dev/example-models", "2847a61097354785ceda9fba40c7f761d6664491",
                   "knitr/lotka-volterra/hudson-bay-lynx-hare.csv",
                   "populations/lynx_hare/hudson-bay-lynx-hare.csv",
                   "66d3b24d30221a5654ab48cc461ea1d3f725f8f5719016f702cfb56610b4ee63")
BOARDING_SCHOOL = Origin("benmaier/boarding_school_SIR", "6bac1711253b3b5b4397ccca31b739a0c06a0fd1",
                         "british_boarding_school.txt",
                         "populations/boarding_school_flu/british_boarding_school.txt",
                         "56f9a828253e758f741f31db6650d48d4ce7aa7d3fc45ed68352451924a1c744")
FALLING_BALLS = Origin("briandesilva/discovery-of-physics-from-data",
                       "b79c34317f049c9b47aaf2cc4c54c5ec7219f3d7", "data/Ball_drops_data.xls",
                       "falling_balls/Ball_drops_data.xls",
                       "942b2d68abfff3828ca323de491435d4ec27c3a22e62cee0cbdf52c2e8d1c0ed")

BALLS = (
    "Baseball",
    "Blue Basketball",
    "Green Basketball",
    "Volleyball",
    "Bowling Ball",
    "Golf Ball",
    "Tennis Ball",
    "Whiffle Ball 1",
    "Whiffle Ball 2",
    "Yellow Whiffle Ball",
    "Orange Whiffle Ball",
)

# Checksums of the motion and of the heights of each run.
SLOSH_CHECKSUMS = {
    "LE_2D_0m_4.8s_900deg": (
        "af238d7e52c870b8da508a8df0f820abf7a75bd09ab118e12ceee59d62ab34dc",
        "181f2bfc2bf152bc5dbbc0681fc3419e80eed3aa3e4185669cde86a007d58e86",
    ),
    "LE_2D_0m_5.3s_900deg": (
        "8e47641c675ea07958d1fb281146db13f218af5f0db3113f4ac50b67d406d12f",
        "4e49fc07afe0d219273d670141e9a347cf9d75739905d21aaac2375e5219ade2",
    ),
    "LE_2D_0m_5s_900deg": (
        "e866aab14601048485ca2ce6b94399961696ec7095e3624e78f75d98ba4bb6db",
        "f38af6d519589612289ebd9393af594b4de32f4999b9177c15d32db5b58a318e",
    ),
    "RD_2D_0.3m_6.3s_720deg": (
        "9bb4c097eb065832c302d6616accc9cd288fb7df4f535901209f32a06ca8cefd",
        "b2e969c96ecae8167aace18660a9a6b1e84f9fbdd059459b3dc483eb24bc6c38",
    ),
    "RD_2D_0.3m_6.5s_720deg": (
        "624cc5c923efa1d070180e629c3555d56e244d60659b46320cb83edffe456667",
        "361cfe8de6c0910d86283148fa18155903a47f234d3ae2c13cce765d39385365",
    ),
    "RD_2D_0.3m_6.8s_720deg": (
        "3a57c2bb1bb51f56d76b40247b30b69b1315ec6408c51c9128a79648dc4af7f5",
        "f77e7d47febc727fe0a7139bc33766352e857966bd654886a72823b95829d6bb",
    ),
    "TRD_2D_0.3m_2.2s_270deg": (
        "a6a0df12c4850ded082b86d47ab664788ff96da1edcfd198bd0910430d361c74",
        "bbd09b77f18b6a86171bde6875e69c5f2f834af786a4db4d462040d28d94168f",
    ),
    "TRD_2D_0.3m_2.4s_270deg": (
        "a26c89cd8fa2d5f82b72ea559a507e25b9793c27fba9207a1285d385554903a1",
        "423e97863ec722e576be95a5aee1e2d09a38068f93bdfa3e2676aa15037f2bc8",
    ),
    "TRD_2D_0.3m_2.6s_270deg": (
        "abb61ae3ebea1cc4693654c1f496f3932bea573cee8be6f58fe529bef32db1ec",
        "83d776db06dffd9de315387d59e78e367c0d79ee180dc1b478ea3ec547de9f99",
    ),
    "Tilt_LE_2D_0m_6.5s_20deg": (
        "b23a4e8ac3d0a5776dcb7275aee76dfb6091b7fcef2a07f8937aebdc3e87a20d",
        "5183b1390ffe60ada80c408f81d2a7a2a5ac23d3d4f0d96d00db3e4eed94c206",
    ),
    "Tilt_LE_2D_0m_6.5s_30deg": (
        "c3d6066d166fee5620513c53bdac5048b983f4c0f1a32af6518b408dcba0760b",
        "d435f212d46f3b6d71db9cb85c4f20cef56d68c1989a8021dbe9ee10aed67c28",
    ),
    "Tilt_LE_2D_0m_6s_20deg": (
        "d8b1c5b9c7a0470deaa0320a5d0f4b370bced0ab25ce11b82db630c4cec102cd",
        "3c484d4da076bb140f0fca410679a097444b7c72616dfee786ecbb582ba4a8cc",
    ),
    "Tilt_LE_2D_0m_6s_30deg": (
        "5f3d56238c8ad5ee9eeda95ab383eff474b9b51dd27f65969257d466fd4408c3",
        "87059d6d993cf2fe5e4a9227acc556807169815ea9c7327adb7f02376eafe27d",
    ),
    "Tilt_LE_2D_0m_7s_20deg": (
        "0ee2680b1ade632d6235520a5fffbd058c4bd75602f4e23f49c88110527cf90f",
        "aad01b8c80f4fb9b1f2946f8c7509c2de15f2a5ad7b5164250af384a86732d7a",
    ),
    "Tilt_LE_2D_0m_7s_30deg": (
        "b2bbff3becd8e30b77270489d0832335bda58a7c2c1b264c8e38719fd1c46192",
        "a0744f421b4ab4fe2c1c99c7485c524cb537543df38b65eda29d0413aa6c41a9",
    ),
}
_SLOSH = (
    "GiorgioMedico/AntiSloshing",
    "75eb65332aeb69836e4e92c82c86b91d182e40bb",
    "Sloshing Models/Models Validation/Motions_10_10_2024",
)


def slosh(name: str) -> tuple[Origin, Origin]:
    """The motion and the heights of one run of the sloshing experiment.

    >>> slosh("LE_2D_0m_5s_900deg")[1].name
    'LE_2D_0m_5s_900deg.mat'
    """
    repository, commit, folder = _SLOSH
    motion, heights = SLOSH_CHECKSUMS[name]
    return (
        Origin(repository, commit, f"{folder}/csv/{name}.csv", f"slosh_lar/motions/{name}.csv",
               motion),
        Origin(repository, commit, f"{folder}/full_slosh/{name}.mat",
               f"slosh_lar/full_slosh/{name}.mat", heights),
    )


def ball_named(name: str) -> str:
    """The name in `BALLS` that is meant; case and blanks do not matter.

    Raises:
        BadSetting: If there is none.

    >>> ball_named("tennis_ball")
    'Tennis Ball'
    """
    plain = {_plain(known): known for known in BALLS}
    check_known("ball", _plain(name), tuple(plain))
    return plain[_plain(name)]


def check_known(what: str, given: str, known: tuple[str, ...]) -> None:
    """Refuse what is not there.

    Raises:
        BadSetting: If `given` is not among the `known`.
    """
    if given not in known:
        raise errors.BadSetting(errors.no_such_data(what, given, known))


def _plain(name: str) -> str:
    return "".join(letter for letter in name.casefold() if letter.isalnum())
