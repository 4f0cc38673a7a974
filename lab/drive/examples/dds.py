"""What the bridges share: a participant of Cyclone DDS on one network interface (`pip install cyclonedds`)."""
import os

from cyclonedds.domain import DomainParticipant

SILENT, FIRST = 5.0, 60.0  # [s] without a state after which a bridge ends; before the first one
NETWORK = """<CycloneDDS><Domain><General><Interfaces><NetworkInterface name="{name}" multicast="{multicast}"/></Interfaces></General>
<Discovery><ParticipantIndex>auto</ParticipantIndex>{peers}</Discovery></Domain></CycloneDDS>"""


def connect(interface, domain):
    """$CYCLONEDDS_URI, where it is set, goes first. The loopback has no multicast: each names the other."""
    loop = interface == "lo"
    os.environ.setdefault("CYCLONEDDS_URI", NETWORK.format(name=interface, multicast="false" if loop else "default",
                                                          peers='<Peers><Peer address="localhost"/></Peers>' if loop else ""))
    return DomainParticipant(domain)


def came(reader):
    """The messages that have come since the last call, oldest first."""
    return [sample for sample in reader.take(16) if sample.sample_info.valid_data]
