"""Another simulator of a DIS exercise, by the package opendis: reads commands as JSON lines and answers each with one.

`{"receive": n}` waits for n entity state PDUs and returns what opendis reads in them; `{"port": p, "send": [...]}` sends some.
"""

import json
import socket
import sys
from io import BytesIO

from opendis.DataOutputStream import DataOutputStream
from opendis.dis7 import (
    DeadReckoningParameters,
    EntityID,
    EntityMarking,
    EntityStatePdu,
    EntityType,
    EulerAngles,
    Vector3Double,
    Vector3Float,
)
from opendis.PduFactory import createPdu
from opendis.RangeCoordinates import GPS


def read(data):
    pdu = createPdu(data)
    at, turned, reckoning = pdu.entityLocation, pdu.entityOrientation, pdu.deadReckoningParameters
    angles = turned.psi, turned.theta, turned.phi
    kind = pdu.entityType
    return {
        "bytes": len(data), "version": pdu.protocolVersion, "exercise": pdu.exerciseID, "type": pdu.pduType,
        "family": pdu.protocolFamily, "length": pdu.length, "timestamp": pdu.timestamp,
        "id": [pdu.entityID.siteID, pdu.entityID.applicationID, pdu.entityID.entityID],
        "force": pdu.forceId, "marking": pdu.marking.charactersString(), "characters": pdu.marking.characterSet,
        "entity": [kind.entityKind, kind.domain, kind.country, kind.category, kind.subcategory, kind.specific, kind.extra],
        "llarpy": [float(x) for x in GPS().ecef2llarpy(at.x, at.y, at.z, *angles)],
        "velocity": [pdu.entityLinearVelocity.x, pdu.entityLinearVelocity.y, pdu.entityLinearVelocity.z],
        "omega": [getattr(reckoning.entityAngularVelocity, axis) for axis in "xyz"],
        "algorithm": reckoning.deadReckoningAlgorithm, "appearance": pdu.entityAppearance,
    }  # fmt: skip


def written(entity):
    x, y, z, psi, theta, phi = (float(v) for v in GPS().llarpy2ecef(*entity["llarpy"]))
    pdu = EntityStatePdu(
        entityID=EntityID(*entity["id"]), forceId=entity.get("force", 2), entityType=EntityType(1, 2, 225, 1),
        entityLocation=Vector3Double(x, y, z), entityOrientation=EulerAngles(psi, theta, phi),
        entityLinearVelocity=Vector3Float(*entity.get("velocity", (0.0, 0.0, 0.0))),
        entityAppearance=entity.get("appearance", 0),
        deadReckoningParameters=DeadReckoningParameters(
            entity.get("algorithm", 2), None, Vector3Float(*entity.get("acceleration", (0.0, 0.0, 0.0))),
            Vector3Float(*entity.get("omega", (0.0, 0.0, 0.0))),
        ),
        marking=EntityMarking(1, [*b"guest", 0, 0, 0, 0, 0, 0]), capabilities=0,
    )  # fmt: skip
    pdu.pduStatus, pdu.protocolVersion, pdu.exerciseID, pdu.protocolFamily = 0, entity.get("version", 7), 1, 1
    pdu.length, pdu.pduType = 144, EntityStatePdu.pduType
    out = BytesIO()
    pdu.serialize(DataOutputStream(out))
    return out.getvalue()


ear = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
ear.bind(("127.0.0.1", 0))
print(json.dumps(ear.getsockname()[1]), flush=True)
for line in sys.stdin:
    command = json.loads(line)
    if "receive" in command:
        answer = [read(ear.recv(65536)) for _ in range(command["receive"])]
    else:
        answer = [written(entity).hex() for entity in command["send"]]
        for text in answer:
            ear.sendto(bytes.fromhex(text), ("127.0.0.1", command["port"]))
    print(json.dumps(answer), flush=True)
